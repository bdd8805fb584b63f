#pragma once
// Ghosts: which particles each rank needs of others, and the exchange of their records, once per step.
// Periodic images of a rank's own particles are handled alike, without MPI.
#include "decomposition/comm.hpp"
#include "solver/core/particles.hpp"
#include "solver/core/tensor.hpp"
#include <array>

namespace kuzure {

/// What is sent to whom until the next rebuild.
struct HaloPlan {
    static constexpr int no_shift = 13;
    struct Send {
        Index owned;
        std::int32_t shift; // index into HaloPlan::shift; no_shift is zero
    };
    struct Peer {
        int rank; // this rank itself for periodic images of its own particles
        std::vector<Send> sends;
    };
    std::vector<Peer> peers;        // by rank; sends by owned index, then shift
    std::array<Vector, 27> shift{}; // added to the owner's position, m
};

/// What the solver must know to sort a ghost in: one of Halo::ghosts().
struct Ghost {
    Vector sorted_position; // shifted, m
    std::int64_t id;
    std::int32_t soil;
};

/// The exchange of one plan. Records arrive by sending rank, those of one rank in its plan's order. Main thread only.
class Halo {
public:
    /// Collective. The plan's counts are exchanged; records of a refresh have one of these sizes, packed without gaps.
    Halo(const Comm&, HaloPlan, std::span<const std::size_t> record_bytes);
    Halo(const Comm& comm, HaloPlan plan, std::size_t record_bytes) : Halo(comm, std::move(plan), std::span(&record_bytes, 1)) {}
    /// The same with the ghosts of these particles in one exchange: as ghosts() gives them.
    Halo(const Comm&, HaloPlan, std::span<const std::size_t> record_bytes, const Particles&, std::vector<Ghost>& arrived);
    Halo(Halo&&) noexcept;
    Halo& operator=(Halo&&) noexcept;
    ~Halo();

    /// Records that arrive in each refresh, own images included.
    Index n_ghosts() const;
    const HaloPlan& plan() const;

    /// One Record per ghost in arrival order, made by its owner: make(Index owned, Vector shift) -> Record. Collective.
    template <class Record, class Make> std::vector<Record> collect(Make make) const
    {
        std::vector<Record> all;
        for (const auto& p : comm().exchange(outgoing<Record>(plan(), make))) all.insert(all.end(), p.items.begin(), p.items.end());
        ensure(all.size() == std::size_t(n_ghosts()), "a halo delivers another number of ghosts than planned");
        return all;
    }
    /// Where each ghost was sorted (shifted), its id and soil (0 where the store has no soil column). Collective.
    std::vector<Ghost> ghosts(const Particles&) const;

    /// Record k of an arrival goes to slot[k] from now on; the identity before the first call.
    void assign_slots(std::span<const Index> slot);

    /// Starts a refresh of records of one of the sizes: copy(Index owned, Vector shift, std::byte* to) writes one record; threads
    /// call it at once.
    template <class Copy> void begin(std::size_t record_bytes, Copy copy)
    {
        start_receives(record_bytes);
        for (int peer = 0; peer < n_out(); ++peer) {
            const Out out = now().out[peer];
            const std::size_t bytes = record_bytes;
            const auto& shift = plan().shift;
#pragma omp parallel for schedule(static) if (out.n > parallel_records)
            for (Index k = 0; k < out.n; ++k) copy(out.sends[k].owned, shift[out.sends[k].shift], out.records + std::size_t(k) * bytes);
            start_send(peer);
        }
    }
    /// The same of the first size.
    template <class Copy> void begin(Copy copy) { begin(channels_.front().record_bytes, copy); }
    /// Lets MPI move what is under way; call it between chunks of work.
    void progress();
    /// Ends the refresh: waits, and hands over each record by put(Index slot, const std::byte* record); threads
    /// call it at once. Throws Broken without a begin().
    template <class Put> void arrive(Put put)
    {
        for (int peer; (peer = next_arrival()) >= 0;) {
            const In in = now().in[peer];
            const std::size_t bytes = now().record_bytes;
            const Index* slot = slot_.data() + in.first;
#pragma omp parallel for schedule(static) if (in.n > parallel_records)
            for (Index k = 0; k < in.n; ++k) put(slot[k], static_cast<const std::byte*>(in.records) + std::size_t(k) * bytes);
        }
        finish();
    }

    /// This rank's sends over MPI in one refresh: records, and bytes of the first size.
    std::int64_t records_per_refresh() const { return records_; }
    std::int64_t bytes_per_refresh() const { return records_ * std::int64_t(channels_.front().record_bytes); }
    int messages_per_refresh() const { return messages_; }
    std::int64_t refreshes() const { return refreshes_; }
    /// Of its plan and buffers.
    std::size_t bytes() const;

private:
    static constexpr Index parallel_records = 2048;
    struct Out {
        const HaloPlan::Send* sends;
        Index n;
        std::byte* records; // for own images, straight into the arrivals
    };
    struct In {
        Index first, n;
        std::byte* records;
    };
    /// Buffers for records of one size.
    struct Channel {
        std::size_t record_bytes;
        std::vector<Out> out;
        std::vector<In> in;
    };
    template <class Record, class Make> static std::vector<MessageOf<Record>> outgoing(const HaloPlan& plan, Make make)
    {
        static_assert(std::is_trivially_copyable_v<Record>);
        std::vector<MessageOf<Record>> out;
        for (const auto& peer : plan.peers) {
            MessageOf<Record> p{peer.rank, {}};
            p.items.reserve(peer.sends.size());
            for (const auto& s : peer.sends) p.items.push_back(make(s.owned, plan.shift[s.shift]));
            if (!p.items.empty()) out.push_back(std::move(p));
        }
        return out;
    }
    /// From what comes of each rank, by rank.
    struct Arrival {
        int rank;
        Index n;
    };
    void open(std::span<const Arrival>, std::span<const std::size_t> record_bytes);
    const Comm& comm() const;
    const Channel& now() const { return channels_[current_]; }
    int n_out() const { return int(channels_.front().out.size()); }
    Channel open_channel(std::size_t record_bytes, std::span<const Arrival>);
    void start_receives(std::size_t record_bytes);
    void start_send(int peer);
    int next_arrival();
    void finish();

    struct Impl;
    std::unique_ptr<Impl> impl_;
    std::vector<Channel> channels_;
    std::size_t current_ = 0; // channel of the refresh under way
    std::vector<Index> slot_;
    std::int64_t records_ = 0, refreshes_ = 0;
    int messages_ = 0;
};

} // namespace kuzure
