#pragma once
// The ranks that work on one run, as everything outside decomposition/ sees them: no MPI type in sight.
// decomposition::Comm implements it over MPI; SingleRank is the one-rank team of tests and of the library without MPI.
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kuzure {

class Team {
public:
    virtual ~Team() = default;
    virtual int rank() const = 0;
    virtual int size() const = 0;
    virtual void barrier() const = 0;
    /// Element-wise over all ranks, in place, on every rank. Sums of doubles are in no fixed order.
    virtual void min(std::span<double>) const = 0;
    virtual void max(std::span<double>) const = 0;
    virtual void sum(std::span<double>) const = 0;
    virtual void min(std::span<std::int64_t>) const = 0;
    virtual void max(std::span<std::int64_t>) const = 0;
    virtual void sum(std::span<std::int64_t>) const = 0;
    /// Sum over the ranks below this one; 0 on rank 0.
    virtual std::int64_t sum_below(std::int64_t) const = 0;
    /// From the root to all; the size must agree beforehand.
    virtual void broadcast(std::span<std::byte>, int root = 0) const = 0;
    /// Everybody's bytes on the root, by rank; empty elsewhere.
    virtual std::vector<std::vector<std::byte>> gather(std::span<const std::byte>, int root = 0) const = 0;
    /// The communicator as the parallel file library wants it (MPI_Comm*), or nullptr for SingleRank.
    virtual void* native() const = 0;

    /// True if it is true on every rank.
    bool all(bool mine) const
    {
        std::int64_t v = mine;
        min(std::span(&v, 1));
        return v != 0;
    }
    bool any(bool mine) const { return !all(!mine); }
    double max(double v) const
    {
        max(std::span(&v, 1));
        return v;
    }
    double min(double v) const
    {
        min(std::span(&v, 1));
        return v;
    }
    /// In no fixed order. Floating point alone, so that a number of seconds is not rounded to whole ones.
    template <std::floating_point F> double sum(F v) const
    {
        double all = v;
        sum(std::span(&all, 1));
        return all;
    }
    std::int64_t sum(std::int64_t v) const
    {
        sum(std::span(&v, 1));
        return v;
    }
    std::int64_t max(std::int64_t v) const
    {
        max(std::span(&v, 1));
        return v;
    }
    /// The root's text on every rank.
    std::string broadcast(std::string s, int root = 0) const
    {
        const auto n = max(rank() == root ? std::int64_t(s.size()) : 0);
        s.resize(std::size_t(n));
        broadcast(std::as_writable_bytes(std::span(s.data(), s.size())), root);
        return s;
    }
};

/// One rank alone.
class SingleRank final : public Team {
public:
    using Team::broadcast;
    using Team::max;
    using Team::min;
    using Team::sum;
    int rank() const override { return 0; }
    int size() const override { return 1; }
    void barrier() const override {}
    void min(std::span<double>) const override {}
    void max(std::span<double>) const override {}
    void sum(std::span<double>) const override {}
    void min(std::span<std::int64_t>) const override {}
    void max(std::span<std::int64_t>) const override {}
    void sum(std::span<std::int64_t>) const override {}
    std::int64_t sum_below(std::int64_t) const override { return 0; }
    void broadcast(std::span<std::byte>, int) const override {}
    std::vector<std::vector<std::byte>> gather(std::span<const std::byte> mine, int) const override
    {
        return {std::vector<std::byte>(mine.begin(), mine.end())};
    }
    void* native() const override { return nullptr; }
};

} // namespace kuzure
