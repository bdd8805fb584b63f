#include "decomposition/halo.hpp"
#include "decomposition/mpi.hpp"
#include <algorithm>
#include <limits>
#include <numeric>

namespace kuzure {

using mpi::check;

struct Halo::Impl {
    const Comm& comm;
    HaloPlan plan;
    std::vector<mpi::Type> record; // of each channel
    Array<std::byte> outgoing, arrivals;
    Index n_ghosts = 0;
    // Of each channel, one request per peer over MPI: first the receives, then the sends. Own images have none.
    std::vector<std::vector<MPI_Request>> channels;
    int n_receives = 0;
    std::vector<int> in_of_receive; // receive request -> index in in_
    std::vector<int> send_of_out;   // index in out_ -> send request, or -1
    int self = -1;                  // index of the own images in in_
    std::vector<int> ready;         // indices in in_ that have arrived and are not handed over
    int outstanding = 0;            // receives that have not arrived
    std::vector<int> finished;      // room for MPI_Testsome, MPI_Waitsome
    bool in_flight = false;

    Impl(const Comm& c, HaloPlan p) : comm(c), plan(std::move(p)) {}
    ~Impl()
    {
        for (auto& requests : channels)
            for (auto& r : requests)
                if (r != MPI_REQUEST_NULL) MPI_Request_free(&r);
    }
    void note(int n)
    {
        for (int k = 0; k < n; ++k) {
            if (finished[k] >= n_receives) continue;
            ready.push_back(in_of_receive[finished[k]]);
            --outstanding;
        }
    }
};

Halo::Halo(Halo&&) noexcept = default;

Halo& Halo::operator=(Halo&& other) noexcept
{
    // A refresh that is still under way (an exception passes by) owns its buffers until MPI ends: leave them to it.
    if (impl_ && impl_->in_flight) static_cast<void>(impl_.release());
    impl_ = std::move(other.impl_);
    channels_ = std::move(other.channels_);
    current_ = other.current_;
    slot_ = std::move(other.slot_);
    records_ = other.records_;
    refreshes_ = other.refreshes_;
    messages_ = other.messages_;
    return *this;
}

Halo::~Halo()
{
    if (impl_ && impl_->in_flight) static_cast<void>(impl_.release());
}

/// Persistent messages for records of so many bytes.
Halo::Channel Halo::open_channel(std::size_t bytes, std::span<const Arrival> arrivals)
{
    Impl& m = *impl_;
    const Comm& comm = m.comm;
    const MPI_Comm mpi_comm = comm.native() ? *static_cast<const MPI_Comm*>(comm.native()) : MPI_COMM_NULL; // none without MPI
    Channel channel{bytes, {}, {}};
    m.record.push_back(comm.native() ? mpi::item_of(bytes) : mpi::Type());
    auto& requests = m.channels.emplace_back();
    Index first = 0;
    for (const auto& c : arrivals) {
        const In in{first, c.n, m.arrivals.data() + std::size_t(first) * bytes};
        if (c.rank != comm.rank()) {
            requests.push_back(MPI_REQUEST_NULL);
            check(MPI_Recv_init(in.records, in.n, m.record.back().type, c.rank, mpi::Refresh, mpi_comm, &requests.back()), "MPI_Recv_init");
        }
        channel.in.push_back(in);
        first += in.n;
    }
    std::byte* next = m.outgoing.data();
    for (const auto& p : m.plan.peers) {
        if (p.sends.empty()) continue;
        Out out{p.sends.data(), Index(p.sends.size()), next};
        if (p.rank == comm.rank()) {
            out.records = channel.in[m.self].records;
        } else {
            next += std::size_t(out.n) * bytes;
            requests.push_back(MPI_REQUEST_NULL);
            check(MPI_Send_init(out.records, out.n, m.record.back().type, p.rank, mpi::Refresh, mpi_comm, &requests.back()),
                  "MPI_Send_init");
        }
        channel.out.push_back(out);
    }
    return channel;
}

Halo::Halo(const Comm& comm, HaloPlan plan, std::span<const std::size_t> record_bytes)
    : impl_(std::make_unique<Impl>(comm, std::move(plan)))
{
    std::vector<MessageOf<std::int64_t>> counts;
    for (const auto& p : impl_->plan.peers)
        if (!p.sends.empty()) counts.push_back({p.rank, {std::int64_t(p.sends.size())}});
    std::vector<Arrival> arrivals;
    for (const auto& c : comm.exchange(counts)) arrivals.push_back({c.rank, Index(c.items.at(0))});
    open(arrivals, record_bytes);
}

namespace {
/// A Ghost as it travels: its soil above the 48 bits that number particles.
struct TravellingGhost {
    Vector sorted_position;
    std::uint64_t id_and_soil;
    Ghost arrived() const
    {
        return {sorted_position, std::int64_t(id_and_soil & ((std::uint64_t(1) << 48) - 1)), std::int32_t(id_and_soil >> 48)};
    }
};
static_assert(sizeof(TravellingGhost) == 32);
/// Makes that of an owned particle.
auto ghost_of(const Particles& p)
{
    return [x = p[field::sorted_position], id = p[field::id],
            soil = p.has(field::soil) ? p[field::soil].column[0] : nullptr](Index i, Vector shift) {
        const std::int64_t number = id[i], of = soil ? soil[i] : 0;
        ensure(number >= 0 && number >> 48 == 0 && of >= 0 && of >> 16 == 0, "a particle's number or soil is too large for a ghost");
        return TravellingGhost{x[i] + shift, std::uint64_t(number) | std::uint64_t(of) << 48};
    };
}
} // namespace

Halo::Halo(const Comm& comm, HaloPlan plan, std::span<const std::size_t> record_bytes, const Particles& particles,
           std::vector<Ghost>& arrived)
    : impl_(std::make_unique<Impl>(comm, std::move(plan)))
{
    arrived.clear();
    std::vector<Arrival> arrivals;
    const auto in = comm.exchange(outgoing<TravellingGhost>(impl_->plan, ghost_of(particles)));
    std::size_t n = 0;
    for (const auto& p : in) n += p.items.size();
    arrived.reserve(n);
    for (const auto& p : in) {
        ensure(p.items.size() <= std::size_t(std::numeric_limits<Index>::max()), "more than 2^31 ghosts on one rank");
        arrivals.push_back({p.rank, Index(p.items.size())});
        for (const auto& g : p.items) arrived.push_back(g.arrived());
    }
    open(arrivals, record_bytes);
}

void Halo::open(std::span<const Arrival> arrivals, std::span<const std::size_t> record_bytes)
{
    ensure(!record_bytes.empty() && std::ranges::min(record_bytes) > 0, "a halo's records have at least one byte");
    Impl& m = *impl_;
    const std::size_t longest = std::ranges::max(record_bytes);
    const int me = m.comm.rank();
    for (const auto& p : m.plan.peers)
        if (p.rank != me && !p.sends.empty()) records_ += std::int64_t(p.sends.size()), ++messages_;
    std::int64_t n_in = 0;
    for (const auto& a : arrivals) n_in += a.n;
    ensure(n_in <= std::numeric_limits<Index>::max() && records_ <= std::numeric_limits<Index>::max(), "more than 2^31 ghosts on one rank");
    m.n_ghosts = Index(n_in);
    m.outgoing.resize(std::size_t(records_) * longest);
    m.arrivals.resize(std::size_t(n_in) * longest);
    for (std::size_t k = 0; k < arrivals.size(); ++k) {
        if (arrivals[k].rank == me) m.self = int(k);
        else m.in_of_receive.push_back(int(k));
    }
    m.n_receives = int(m.in_of_receive.size());
    int n_requests = m.n_receives;
    for (const auto& p : m.plan.peers)
        if (!p.sends.empty()) m.send_of_out.push_back(p.rank == me ? -1 : n_requests++);

    for (const std::size_t bytes : record_bytes) {
        if (std::ranges::any_of(channels_, [&](const Channel& c) { return c.record_bytes == bytes; })) continue;
        channels_.push_back(open_channel(bytes, arrivals));
    }
    m.finished.resize(std::size_t(n_requests));
    slot_.resize(m.n_ghosts);
    std::iota(slot_.begin(), slot_.end(), 0);
}

Index Halo::n_ghosts() const { return impl_->n_ghosts; }
const HaloPlan& Halo::plan() const { return impl_->plan; }
const Comm& Halo::comm() const { return impl_->comm; }

std::size_t Halo::bytes() const
{
    std::size_t b = impl_->outgoing.capacity() + impl_->arrivals.capacity() + slot_.capacity() * sizeof(Index);
    for (const auto& p : plan().peers) b += p.sends.capacity() * sizeof(HaloPlan::Send);
    return b;
}

std::vector<Ghost> Halo::ghosts(const Particles& p) const
{
    std::vector<Ghost> all;
    for (const auto& g : collect<TravellingGhost>(ghost_of(p))) all.push_back(g.arrived());
    return all;
}

void Halo::assign_slots(std::span<const Index> slot)
{
    ensure(slot.size() == slot_.size(), "a halo needs one slot per ghost");
    slot_.assign(slot.begin(), slot.end());
}

void Halo::start_receives(std::size_t record_bytes)
{
    Impl& m = *impl_;
    ensure(!m.in_flight, "a refresh begins while another is under way");
    const auto channel = std::ranges::find(channels_, record_bytes, &Channel::record_bytes);
    ensure(channel != channels_.end(), "a refresh has records of a size that its halo was not made for");
    current_ = std::size_t(channel - channels_.begin());
    m.in_flight = true;
    m.outstanding = m.n_receives;
    m.ready.clear();
    if (m.self >= 0) m.ready.push_back(m.self);
    if (m.n_receives) check(MPI_Startall(m.n_receives, m.channels[current_].data()), "MPI_Startall");
}

void Halo::start_send(int peer)
{
    Impl& m = *impl_;
    const int k = m.send_of_out[peer];
    if (k >= 0) check(MPI_Start(&m.channels[current_][k]), "MPI_Start");
}

void Halo::progress()
{
    Impl& m = *impl_;
    auto& requests = m.channels[current_];
    if (!m.in_flight || requests.empty()) return;
    int n = 0;
    check(MPI_Testsome(int(requests.size()), requests.data(), &n, m.finished.data(), MPI_STATUSES_IGNORE), "MPI_Testsome");
    if (n != MPI_UNDEFINED) m.note(n);
}

int Halo::next_arrival()
{
    Impl& m = *impl_;
    ensure(m.in_flight, "a refresh ends that was not begun");
    while (m.ready.empty() && m.outstanding > 0) {
        int n = 0;
        check(MPI_Waitsome(m.n_receives, m.channels[current_].data(), &n, m.finished.data(), MPI_STATUSES_IGNORE), "MPI_Waitsome");
        ensure(n != MPI_UNDEFINED, "a halo waits for messages that are not under way");
        m.note(n);
    }
    if (m.ready.empty()) return -1;
    const int peer = m.ready.back();
    m.ready.pop_back();
    return peer;
}

void Halo::finish()
{
    Impl& m = *impl_;
    auto& requests = m.channels[current_];
    const int sends = int(requests.size()) - m.n_receives;
    if (sends > 0) check(MPI_Waitall(sends, requests.data() + m.n_receives, MPI_STATUSES_IGNORE), "MPI_Waitall");
    m.in_flight = false;
    ++refreshes_;
}

} // namespace kuzure
