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
    mpi::Type row;
    Array<std::byte> outgoing, arrivals;
    Index n_ghosts = 0;
    // One request per peer over MPI: first the receives, then the sends. Own images have none.
    std::vector<MPI_Request> requests;
    int n_receives = 0;
    std::vector<int> in_of_receive; // receive request -> place in in_
    std::vector<int> send_of_out;   // place in out_ -> send request, or -1
    int self = -1;                  // place of the own images in in_
    std::vector<int> ready;         // places in in_ that have arrived and are not handed over
    int outstanding = 0;            // receives that have not arrived
    std::vector<int> finished;      // room for MPI_Testsome, MPI_Waitsome
    bool in_flight = false;

    Impl(const Comm& c, HaloPlan p) : comm(c), plan(std::move(p)) {}
    ~Impl()
    {
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
    // A refresh that is still under way (an exception passes by) owns its buffers until MPI ends: leave them
    // to it.
    if (impl_ && impl_->in_flight) static_cast<void>(impl_.release());
    impl_ = std::move(other.impl_);
    out_ = std::move(other.out_);
    in_ = std::move(other.in_);
    slot_ = std::move(other.slot_);
    row_bytes_ = other.row_bytes_;
    bytes_ = other.bytes_;
    refreshes_ = other.refreshes_;
    messages_ = other.messages_;
    return *this;
}

Halo::~Halo()
{
    if (impl_ && impl_->in_flight) static_cast<void>(impl_.release());
}

Halo::Halo(const Comm& comm, HaloPlan plan, std::size_t row_bytes)
    : impl_(std::make_unique<Impl>(comm, std::move(plan))), row_bytes_(row_bytes)
{
    ensure(row_bytes > 0, "a halo's rows have at least one byte");
    Impl& m = *impl_;
    m.row = mpi::item_of(row_bytes);
    const MPI_Comm mpi_comm = *static_cast<const MPI_Comm*>(comm.native());

    std::vector<Parcel<std::int64_t>> counts;
    std::int64_t n_out = 0, n_in = 0;
    for (const auto& p : m.plan.peers) {
        const auto n = std::int64_t(p.sends.size());
        if (n == 0) continue;
        counts.push_back({p.rank, {n}});
        if (p.rank != comm.rank()) n_out += n;
    }
    counts = comm.exchange(counts);
    for (const auto& c : counts) n_in += c.items.at(0);
    ensure(n_in <= std::numeric_limits<Index>::max() && n_out <= std::numeric_limits<Index>::max(), "more than 2^31 ghosts on one rank");
    m.n_ghosts = Index(n_in);
    m.outgoing.resize(std::size_t(n_out) * row_bytes);
    m.arrivals.resize(std::size_t(n_in) * row_bytes);

    Index first = 0;
    for (const auto& c : counts) {
        const In in{first, Index(c.items[0]), m.arrivals.data() + std::size_t(first) * row_bytes};
        if (c.rank == comm.rank()) {
            m.self = int(in_.size());
        } else {
            m.in_of_receive.push_back(int(in_.size()));
            m.requests.push_back(MPI_REQUEST_NULL);
            check(MPI_Recv_init(in.rows, in.n, m.row.type, c.rank, mpi::Refresh, mpi_comm, &m.requests.back()), "MPI_Recv_init");
        }
        in_.push_back(in);
        first += in.n;
    }
    m.n_receives = int(m.requests.size());

    std::byte* rows = m.outgoing.data();
    for (const auto& p : m.plan.peers) {
        if (p.sends.empty()) continue;
        Out out{p.sends.data(), Index(p.sends.size()), rows};
        if (p.rank == comm.rank()) {
            out.rows = in_[m.self].rows;
            m.send_of_out.push_back(-1);
        } else {
            rows += std::size_t(out.n) * row_bytes;
            m.send_of_out.push_back(int(m.requests.size()));
            m.requests.push_back(MPI_REQUEST_NULL);
            check(MPI_Send_init(out.rows, out.n, m.row.type, p.rank, mpi::Refresh, mpi_comm, &m.requests.back()), "MPI_Send_init");
            bytes_ += std::int64_t(out.n) * std::int64_t(row_bytes);
            ++messages_;
        }
        out_.push_back(out);
    }
    m.finished.resize(m.requests.size());
    slot_.resize(m.n_ghosts);
    std::iota(slot_.begin(), slot_.end(), 0);
}

Index Halo::n_ghosts() const { return impl_->n_ghosts; }
const HaloPlan& Halo::plan() const { return impl_->plan; }
const Comm& Halo::comm() const { return impl_->comm; }

std::vector<Ghost> Halo::ghosts(const Particles& p) const
{
    const auto x = p[field::sorted_position];
    const auto id = p[field::id];
    const std::int32_t* soil = p.has(field::soil) ? p[field::soil].column[0] : nullptr;
    return collect<Ghost>([&](Index i, Vector shift) {
        Ghost g{};
        g.sorted_position = x[i] + shift;
        g.id = id[i];
        g.soil = soil ? soil[i] : 0;
        return g;
    });
}

void Halo::place(std::span<const Index> slot)
{
    ensure(slot.size() == slot_.size(), "a halo needs one slot per ghost");
    slot_.assign(slot.begin(), slot.end());
}

void Halo::start_receives()
{
    Impl& m = *impl_;
    ensure(!m.in_flight, "a refresh begins while another is under way");
    m.in_flight = true;
    m.outstanding = m.n_receives;
    m.ready.clear();
    if (m.self >= 0) m.ready.push_back(m.self);
    if (m.n_receives) check(MPI_Startall(m.n_receives, m.requests.data()), "MPI_Startall");
}

void Halo::start_send(int peer)
{
    Impl& m = *impl_;
    const int k = m.send_of_out[peer];
    if (k >= 0) check(MPI_Start(&m.requests[k]), "MPI_Start");
}

void Halo::progress()
{
    Impl& m = *impl_;
    if (!m.in_flight || m.requests.empty()) return;
    int n = 0;
    check(MPI_Testsome(int(m.requests.size()), m.requests.data(), &n, m.finished.data(), MPI_STATUSES_IGNORE), "MPI_Testsome");
    if (n != MPI_UNDEFINED) m.note(n);
}

int Halo::next_arrival()
{
    Impl& m = *impl_;
    ensure(m.in_flight, "a refresh ends that was not begun");
    while (m.ready.empty() && m.outstanding > 0) {
        int n = 0;
        check(MPI_Waitsome(m.n_receives, m.requests.data(), &n, m.finished.data(), MPI_STATUSES_IGNORE), "MPI_Waitsome");
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
    const int sends = int(m.requests.size()) - m.n_receives;
    check(MPI_Waitall(sends, m.requests.data() + m.n_receives, MPI_STATUSES_IGNORE), "MPI_Waitall");
    m.in_flight = false;
    ++refreshes_;
}

} // namespace kuzure
