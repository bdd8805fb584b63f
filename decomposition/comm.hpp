#pragma once
// The ranks of a run, over MPI or one alone without it. No MPI type is visible here; every MPI return code becomes an exception
// (MpiFailed). All calls belong to the main thread (MPI_THREAD_FUNNELED).
#include "solver/core/ensure.hpp"
#include "solver/core/team.hpp"
#include <array>
#include <cstring>
#include <memory>
#include <type_traits>

namespace kuzure {

/// An MPI call failed. The message names the call and MPI's own words.
struct MpiFailed : std::runtime_error {
    using runtime_error::runtime_error;
};

/// What the launcher that started this process says of it, without asking MPI. size 0: there was no launcher; size -1: it does not say.
struct Launched {
    int rank = 0, size = 0;
    explicit operator bool() const { return size != 0; }
};
/// From the environment: mpirun, mpiexec and srun of the usual MPI libraries. KUZURE_MPI=1 says that there is one whatever it sets, 0 that
/// there is none.
Launched launched();

/// The ranks from construction to destruction, with Comm::world() in between. One per program. A rank that fails alone must abort():
/// finalizing waits.
class Environment {
public:
    /// With MPI. Throws MpiFailed where it does not start or grants less than MPI_THREAD_FUNNELED.
    Environment(int& argc, char**& argv);
    /// Without MPI: this process alone.
    Environment();
    Environment(const Environment&) = delete;
    ~Environment();
};

/// Bytes to or from a rank.
struct Message {
    int rank;
    std::vector<std::byte> bytes;
};
/// The same for values of a trivially copyable type.
template <class T> struct MessageOf {
    int rank;
    std::vector<T> items;
};
/// Items as bytes.
template <class T> std::vector<Message> to_messages(std::span<const MessageOf<T>> typed)
{
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<Message> bytes;
    for (const auto& p : typed) {
        const auto b = std::as_bytes(std::span(p.items));
        bytes.push_back({p.rank, {b.begin(), b.end()}});
    }
    return bytes;
}
/// And back.
template <class T> std::vector<MessageOf<T>> from_messages(const std::vector<Message>& messages)
{
    std::vector<MessageOf<T>> in;
    for (const Message& m : messages) {
        ensure(m.bytes.size() % sizeof(T) == 0, "a typed message holds a fraction of an item");
        in.push_back({m.rank, std::vector<T>(m.bytes.size() / sizeof(T))});
        if (!m.bytes.empty()) std::memcpy(in.back().items.data(), m.bytes.data(), m.bytes.size());
    }
    return in;
}
/// Where this rank sits among those that share its memory; nodes are numbered by their lowest rank.
struct NodePosition {
    int rank, size;
    int node, nodes;
};

class Comm final : public Team {
public:
    using Team::broadcast;
    using Team::max;
    using Team::min;
    using Team::sum;
    static constexpr std::size_t largest_piece = std::size_t(1) << 30;

    /// All ranks of the program, on a communicator of kuzure's own. Throws Broken outside an Environment.
    static const Comm& world();
    /// Name and version of the MPI library.
    static std::string library();
    Comm(const Comm&) = delete;
    ~Comm() override;

    int rank() const override { return rank_; }
    int size() const override { return size_; }
    void barrier() const override;
    void min(std::span<double>) const override;
    void max(std::span<double>) const override;
    void sum(std::span<double>) const override;
    void min(std::span<std::int64_t>) const override;
    void max(std::span<std::int64_t>) const override;
    void sum(std::span<std::int64_t>) const override;
    std::int64_t sum_below(std::int64_t) const override;
    void broadcast(std::span<std::byte>, int root = 0) const override;
    std::vector<std::vector<std::byte>> gather(std::span<const std::byte>, int root = 0) const override;
    /// nullptr without MPI.
    void* native() const override;

    /// Each rank sends to any ranks, which need not know of it before: all messages for this rank, by sender,
    /// those of one sender in the order sent. Collective. Only pairs with data talk (Hoefler, Siebert,
    /// Lumsdaine 2010: NBX). A message longer than `piece` bytes travels as one derived type, so 2 GiB is no limit.
    std::vector<Message> exchange(std::vector<Message> out, std::size_t piece = largest_piece) const;
    /// The same, typed.
    template <class T> std::vector<MessageOf<T>> exchange(const std::vector<MessageOf<T>>& out) const
    {
        return from_messages<T>(exchange(to_messages(std::span(out))));
    }
    /// Exchanges one number with each of some other ranks; theirs, in the order of `peers`. Not collective:
    /// only those that name each other meet.
    std::vector<double> exchange_scalar(std::span<const int> peers, double mine) const;
    /// One value of each rank, by rank, on every rank.
    template <class T> std::vector<T> allgather(const T& mine) const
    {
        static_assert(std::is_trivially_copyable_v<T>);
        std::vector<T> all(static_cast<std::size_t>(size_));
        allgather_bytes(&mine, all.data(), sizeof(T));
        return all;
    }
    /// Any number of values of each rank, in the order of the ranks, on every rank.
    template <class T> std::vector<T> allgather(std::span<const T> mine) const
    {
        static_assert(std::is_trivially_copyable_v<T>);
        const auto counts = allgather(std::int64_t(mine.size()));
        std::int64_t total = 0;
        for (const auto c : counts) total += c;
        std::vector<T> all(static_cast<std::size_t>(total));
        allgather_bytes(mine.data(), all.data(), sizeof(T), counts);
        return all;
    }
    /// Collective.
    NodePosition node_position() const;
    /// End every rank of the program with this exit code, without waiting for them.
    [[noreturn]] void abort(int code) const;

private:
    friend class Environment;
    struct Handle;
    explicit Comm(std::unique_ptr<Handle>);
    void allgather_bytes(const void* mine, void* all, std::size_t item) const;
    void allgather_bytes(const void* mine, void* all, std::size_t item, std::span<const std::int64_t> counts) const;

    std::unique_ptr<Handle> handle_; // none without MPI
    int rank_ = 0, size_ = 1;
    mutable int round_ = 0; // exchanges so far: two that follow each other use different tags
};

} // namespace kuzure
