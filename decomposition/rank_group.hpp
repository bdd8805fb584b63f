#pragma once
// Ranks that work in rounds of messages: the one of this process among those of a run, or all of a run that does not exist, so that what
// many ranks would agree on can be tried in one program.
#include "decomposition/comm.hpp"

namespace kuzure {

/// Ranks first() .. first() + here() - 1 of size() are computed here. Everything is collective.
class RankGroup {
public:
    virtual ~RankGroup() = default;
    virtual int size() const = 0;
    virtual int first() const = 0;
    virtual int here() const = 0;
    /// Each rank here sends to any ranks; what arrives for each, by sender.
    virtual std::vector<std::vector<Message>> exchange(std::vector<std::vector<Message>> out) const = 0;
    /// Each rank here exchanges one number with each of its peers; being peers is mutual.
    virtual std::vector<std::vector<double>> exchange_scalar(const std::vector<std::vector<int>>& peers,
                                                             std::span<const double> mine) const = 0;
    /// Sums and maxima over all ranks, of figures that are already those of all ranks here.
    virtual void sum(std::span<double>) const = 0;
    virtual void max(std::span<double>) const = 0;
    /// Six numbers of each rank, by rank.
    virtual std::vector<std::array<std::int32_t, 6>> allgather(std::span<const std::array<std::int32_t, 6>> mine) const = 0;

    /// Typed.
    template <class T> std::vector<std::vector<MessageOf<T>>> exchange(const std::vector<std::vector<MessageOf<T>>>& out) const
    {
        std::vector<std::vector<Message>> bytes(out.size());
        for (std::size_t k = 0; k < out.size(); ++k) bytes[k] = to_messages(std::span(out[k]));
        auto arrived = exchange(std::move(bytes));
        std::vector<std::vector<MessageOf<T>>> in(arrived.size());
        for (std::size_t k = 0; k < arrived.size(); ++k) in[k] = from_messages<T>(arrived[k]);
        return in;
    }
};

/// The ranks of a run.
class RunRanks final : public RankGroup {
public:
    explicit RunRanks(const Comm& comm) : comm_(comm) {}
    using RankGroup::exchange;
    int size() const override { return comm_.size(); }
    int first() const override { return comm_.rank(); }
    int here() const override { return 1; }
    std::vector<std::vector<Message>> exchange(std::vector<std::vector<Message>> out) const override
    {
        return {comm_.exchange(std::move(out[0]))};
    }
    std::vector<std::vector<double>> exchange_scalar(const std::vector<std::vector<int>>& peers,
                                                     std::span<const double> mine) const override
    {
        return {comm_.exchange_scalar(peers[0], mine[0])};
    }
    void sum(std::span<double> v) const override { comm_.sum(v); }
    void max(std::span<double> v) const override { comm_.max(v); }
    std::vector<std::array<std::int32_t, 6>> allgather(std::span<const std::array<std::int32_t, 6>> mine) const override
    {
        return comm_.allgather(mine[0]);
    }

private:
    const Comm& comm_;
};

/// Any number of ranks, all of them here.
class VirtualRanks final : public RankGroup {
public:
    explicit VirtualRanks(int ranks) : ranks_(ranks) {}
    using RankGroup::exchange;
    int size() const override { return ranks_; }
    int first() const override { return 0; }
    int here() const override { return ranks_; }
    std::vector<std::vector<Message>> exchange(std::vector<std::vector<Message>> out) const override
    {
        std::vector<std::vector<Message>> in(out.size());
        for (int from = 0; from < ranks_; ++from)
            for (Message& m : out[from]) in[m.rank].push_back({from, std::move(m.bytes)});
        return in;
    }
    std::vector<std::vector<double>> exchange_scalar(const std::vector<std::vector<int>>& peers,
                                                     std::span<const double> mine) const override
    {
        std::vector<std::vector<double>> received(peers.size());
        for (std::size_t k = 0; k < peers.size(); ++k)
            for (const int p : peers[k]) received[k].push_back(mine[p]);
        return received;
    }
    void sum(std::span<double>) const override {}
    void max(std::span<double>) const override {}
    std::vector<std::array<std::int32_t, 6>> allgather(std::span<const std::array<std::int32_t, 6>> mine) const override
    {
        return {mine.begin(), mine.end()};
    }

private:
    int ranks_;
};

} // namespace kuzure
