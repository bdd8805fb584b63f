#include "decomposition/comm.hpp"
#include "decomposition/mpi.hpp"
#include <algorithm>
#include <climits>
#include <cstdio>
#include <cstdlib>

namespace kuzure {

using mpi::check;

struct Comm::Handle {
    MPI_Comm comm = MPI_COMM_NULL;
};

namespace {

std::unique_ptr<Comm>& the_world()
{
    static std::unique_ptr<Comm> world;
    return world;
}

/// `bytes` bytes as one item, however many.
mpi::Type long_item(std::size_t bytes, std::size_t piece)
{
    const std::size_t whole = bytes / piece, remainder = bytes % piece;
    if (whole > std::size_t(INT_MAX)) throw MpiFailed("a message of " + std::to_string(bytes) + " bytes is too long");
    const mpi::Type one = mpi::item_of(piece);
    const int lengths[2] = {int(whole), int(remainder)};
    const MPI_Aint starts[2] = {0, MPI_Aint(whole * piece)};
    const MPI_Datatype types[2] = {one.type, MPI_BYTE};
    mpi::Type all;
    check(MPI_Type_create_struct(2, lengths, starts, types, &all.type), "MPI_Type_create_struct");
    check(MPI_Type_commit(&all.type), "MPI_Type_commit");
    return all;
}

/// How a message of this length is described to MPI.
struct Layout {
    mpi::Type own;
    MPI_Datatype type = MPI_BYTE;
    int count;
    Layout(std::size_t bytes, std::size_t piece) : count(int(bytes))
    {
        if (bytes <= piece) return;
        own = long_item(bytes, piece);
        type = own.type;
        count = 1;
    }
};

} // namespace

Launched launched()
{
    const auto number = [](const char* name, int otherwise) {
        const char* text = std::getenv(name);
        return text && *text ? std::atoi(text) : otherwise;
    };
    // Rank and size as each launcher calls them; Slurm's, beside PMI's, only tell of its own ranks: a shell in a job has them too.
    constexpr std::pair<const char*, const char*> launchers[] = {{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"}, // Open MPI
                                                                 {"PMI_RANK", "PMI_SIZE"}, // MPICH, Intel MPI, srun --mpi=pmi2
                                                                 {"MV2_COMM_WORLD_RANK", "MV2_COMM_WORLD_SIZE"}, // MVAPICH
                                                                 {"PMIX_RANK", "SLURM_STEP_NUM_TASKS"}, // srun --mpi=pmix, Fujitsu MPI
                                                                 {"PALS_RANKID", "PALS_SIZE"},          // Cray
                                                                 {"JSM_NAMESPACE_RANK", "JSM_NAMESPACE_SIZE"}}; // Spectrum MPI
    Launched found;
    for (const auto& [rank, size] : launchers)
        if (!found && std::getenv(rank)) found = {number(rank, 0), std::max(number(size, -1), -1)};
    if (found.size == 0 && number("SLURM_STEP_NUM_TASKS", 1) > 1) found = {number("SLURM_PROCID", 0), number("SLURM_STEP_NUM_TASKS", -1)};
    const int asked = number("KUZURE_MPI", -1);
    if (asked == 0) return {};
    if (asked > 0 && !found) return {number("SLURM_PROCID", 0), -1};
    return found;
}

// ---- start and end --------------------------------------------------------------------------------------------------
Environment::Environment(int& argc, char**& argv)
{
    ensure(!the_world(), "two MPI environments in one program");
    int granted = 0;
    check(MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &granted), "MPI_Init_thread");
    if (granted < MPI_THREAD_FUNNELED) throw MpiFailed("this MPI library grants no threads (MPI_THREAD_FUNNELED is needed)");
    // HDF5 works on duplicates of these: they too must return their errors instead of ending the program.
    check(MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
    check(MPI_Comm_set_errhandler(MPI_COMM_SELF, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
    auto handle = std::make_unique<Comm::Handle>();
    check(MPI_Comm_dup(MPI_COMM_WORLD, &handle->comm), "MPI_Comm_dup");
    the_world().reset(new Comm(std::move(handle)));
}

Environment::Environment()
{
    ensure(!the_world(), "two environments in one program");
    the_world().reset(new Comm(nullptr));
}

Environment::~Environment()
{
    const bool with_mpi = the_world()->handle_ != nullptr;
    the_world().reset();
    if (with_mpi) MPI_Finalize();
}

Comm::Comm(std::unique_ptr<Handle> handle) : handle_(std::move(handle))
{
    if (!handle_) return;
    check(MPI_Comm_set_errhandler(handle_->comm, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
    check(MPI_Comm_rank(handle_->comm, &rank_), "MPI_Comm_rank");
    check(MPI_Comm_size(handle_->comm, &size_), "MPI_Comm_size");
}

Comm::~Comm()
{
    if (handle_) MPI_Comm_free(&handle_->comm);
}

std::string Comm::library()
{
    // "Open MPI v4.1.4, package: Debian Open MPI, ...", "MPICH Version: 4.0.2\n..."
    char text[MPI_MAX_LIBRARY_VERSION_STRING] = "";
    int length = 0;
    MPI_Get_library_version(text, &length);
    const std::string all(text, std::size_t(length));
    return all.substr(0, all.find_first_of(",\n"));
}

const Comm& Comm::world()
{
    ensure(the_world() != nullptr, "Comm::world() outside an Environment");
    return *the_world();
}

void* Comm::native() const { return handle_ ? &handle_->comm : nullptr; }

void Comm::abort(int code) const
{
    std::fflush(nullptr);
    if (!handle_) std::_Exit(code);
    MPI_Abort(MPI_COMM_WORLD, code);
    std::abort();
}

// ---- all ranks at once ----------------------------------------------------------------------------------------------
void Comm::barrier() const
{
    if (handle_) check(MPI_Barrier(handle_->comm), "MPI_Barrier");
}

namespace {
template <class T> void reduce(std::span<T> v, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
    check(MPI_Allreduce(MPI_IN_PLACE, v.data(), int(v.size()), type, op, comm), "MPI_Allreduce");
}
} // namespace

void Comm::min(std::span<double> v) const
{
    if (handle_) reduce(v, MPI_DOUBLE, MPI_MIN, handle_->comm);
}
void Comm::max(std::span<double> v) const
{
    if (handle_) reduce(v, MPI_DOUBLE, MPI_MAX, handle_->comm);
}
void Comm::sum(std::span<double> v) const
{
    if (handle_) reduce(v, MPI_DOUBLE, MPI_SUM, handle_->comm);
}
void Comm::min(std::span<std::int64_t> v) const
{
    if (handle_) reduce(v, MPI_INT64_T, MPI_MIN, handle_->comm);
}
void Comm::max(std::span<std::int64_t> v) const
{
    if (handle_) reduce(v, MPI_INT64_T, MPI_MAX, handle_->comm);
}
void Comm::sum(std::span<std::int64_t> v) const
{
    if (handle_) reduce(v, MPI_INT64_T, MPI_SUM, handle_->comm);
}

std::int64_t Comm::sum_below(std::int64_t mine) const
{
    std::int64_t below = 0;
    if (!handle_) return below;
    check(MPI_Exscan(&mine, &below, 1, MPI_INT64_T, MPI_SUM, handle_->comm), "MPI_Exscan");
    return rank_ == 0 ? 0 : below;
}

void Comm::broadcast(std::span<std::byte> bytes, int root) const
{
    if (!handle_) return;
    for (std::size_t at = 0; at < bytes.size(); at += largest_piece) {
        const std::size_t n = std::min(largest_piece, bytes.size() - at);
        check(MPI_Bcast(bytes.data() + at, int(n), MPI_BYTE, root, handle_->comm), "MPI_Bcast");
    }
}

std::vector<std::vector<std::byte>> Comm::gather(std::span<const std::byte> mine, int root) const
{
    std::vector<std::vector<std::byte>> all;
    if (!handle_) return {{mine.begin(), mine.end()}};
    const std::int64_t n = std::int64_t(mine.size());
    std::vector<std::int64_t> sizes(rank_ == root ? std::size_t(size_) : 0);
    // clang-tidy 14 does not know that MPI_INT64_T is std::int64_t.
    check(MPI_Gather(&n, 1, MPI_INT64_T, sizes.data(), 1, MPI_INT64_T, root, handle_->comm), "MPI_Gather"); // NOLINT(mpi-type-mismatch)
    if (rank_ != root) {
        if (n == 0) return all;
        const Layout layout(mine.size(), largest_piece);
        check(MPI_Send(mine.data(), layout.count, layout.type, root, mpi::Gather, handle_->comm), "MPI_Send");
        return all;
    }
    all.resize(std::size_t(size_));
    std::vector<MPI_Request> requests;
    for (int r = 0; r < size_; ++r) {
        if (r == root || sizes[r] == 0) continue;
        all[r].resize(std::size_t(sizes[r]));
        const Layout layout(all[r].size(), largest_piece);
        requests.emplace_back();
        check(MPI_Irecv(all[r].data(), layout.count, layout.type, r, mpi::Gather, handle_->comm, &requests.back()), "MPI_Irecv");
    }
    all[root].assign(mine.begin(), mine.end());
    check(MPI_Waitall(int(requests.size()), requests.data(), MPI_STATUSES_IGNORE), "MPI_Waitall");
    return all;
}

void Comm::allgather_bytes(const void* mine, void* all, std::size_t item) const
{
    if (!handle_) {
        std::memcpy(all, mine, item);
        return;
    }
    const mpi::Type type = mpi::item_of(item);
    check(MPI_Allgather(mine, 1, type.type, all, 1, type.type, handle_->comm), "MPI_Allgather");
}

void Comm::allgather_bytes(const void* mine, void* all, std::size_t item, std::span<const std::int64_t> counts) const
{
    if (!handle_) {
        if (counts[0] > 0) std::memcpy(all, mine, std::size_t(counts[0]) * item);
        return;
    }
    std::vector<int> count, start;
    std::int64_t total = 0;
    for (const std::int64_t c : counts) {
        count.push_back(int(c));
        start.push_back(int(total));
        total += c;
        if (total > INT_MAX) throw MpiFailed("an all-gather of more than 2^31 items");
    }
    const mpi::Type type = mpi::item_of(item);
    check(MPI_Allgatherv(mine, count[rank_], type.type, all, count.data(), start.data(), type.type, handle_->comm), "MPI_Allgatherv");
}

// ---- sparse exchange ------------------------------------------------------------------------------------------------
std::vector<Message> Comm::exchange(std::vector<Message> out, std::size_t piece) const
{
    ensure(piece > 0 && piece <= largest_piece, "exchange: pieces must hold 1 byte to 1 GiB");
    // A rank that has left this round may already send in the next while others still receive here. No rank can
    // be two rounds ahead, so two tags in turn keep them apart.
    const int tag = round_++ % 2 ? mpi::Odd : mpi::Even;
    std::vector<Message> in;
    std::vector<MPI_Request> sends;
    for (Message& m : out) {
        ensure(m.rank >= 0 && m.rank < size_, "exchange: a message to a rank that does not exist");
        if (m.rank == rank_) {
            in.push_back(std::move(m));
            continue;
        }
        const Layout layout(m.bytes.size(), piece);
        sends.emplace_back();
        check(MPI_Issend(m.bytes.data(), layout.count, layout.type, m.rank, tag, handle_->comm, &sends.back()), "MPI_Issend");
    }
    if (!handle_) return in;
    // Synchronous sends complete when they are received: once all of mine are, I enter the barrier, and once
    // every rank is in it, no message is under way.
    MPI_Request all_done = MPI_REQUEST_NULL;
    bool in_barrier = false;
    for (int done = 0; !done;) {
        int found = 0;
        MPI_Message message;
        MPI_Status status;
        check(MPI_Improbe(MPI_ANY_SOURCE, tag, handle_->comm, &found, &message, &status), "MPI_Improbe");
        if (found) {
            MPI_Count bytes = 0;
            check(MPI_Get_elements_x(&status, MPI_BYTE, &bytes), "MPI_Get_elements_x");
            Message m{status.MPI_SOURCE, std::vector<std::byte>(std::size_t(bytes))};
            const Layout layout(m.bytes.size(), piece);
            check(MPI_Mrecv(m.bytes.data(), layout.count, layout.type, &message, MPI_STATUS_IGNORE), "MPI_Mrecv");
            in.push_back(std::move(m));
        } else if (in_barrier) {
            check(MPI_Test(&all_done, &done, MPI_STATUS_IGNORE), "MPI_Test");
        } else {
            int sent = 0;
            check(MPI_Testall(int(sends.size()), sends.data(), &sent, MPI_STATUSES_IGNORE), "MPI_Testall");
            if (!sent) continue;
            check(MPI_Ibarrier(handle_->comm, &all_done), "MPI_Ibarrier");
            in_barrier = true;
        }
    }
    std::ranges::stable_sort(in, {}, &Message::rank);
    return in;
}

std::vector<double> Comm::exchange_scalar(std::span<const int> peers, double mine) const
{
    std::vector<double> theirs(peers.size());
    if (peers.empty()) return theirs;
    std::vector<MPI_Request> requests(2 * peers.size());
    for (std::size_t k = 0; k < peers.size(); ++k) {
        ensure(peers[k] >= 0 && peers[k] < size_ && peers[k] != rank_, "exchange_scalar: a peer that is no other rank");
        check(MPI_Irecv(&theirs[k], 1, MPI_DOUBLE, peers[k], mpi::Scalar, handle_->comm, &requests[k]), "MPI_Irecv");
    }
    for (std::size_t k = 0; k < peers.size(); ++k)
        check(MPI_Isend(&mine, 1, MPI_DOUBLE, peers[k], mpi::Scalar, handle_->comm, &requests[peers.size() + k]), "MPI_Isend");
    check(MPI_Waitall(int(requests.size()), requests.data(), MPI_STATUSES_IGNORE), "MPI_Waitall");
    return theirs;
}

NodePosition Comm::node_position() const
{
    if (!handle_) return {.rank = 0, .size = 1, .node = 0, .nodes = 1};
    MPI_Comm shared = MPI_COMM_NULL;
    check(MPI_Comm_split_type(handle_->comm, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &shared), "MPI_Comm_split_type");
    NodePosition here{};
    int lowest = rank_;
    check(MPI_Comm_rank(shared, &here.rank), "MPI_Comm_rank");
    check(MPI_Comm_size(shared, &here.size), "MPI_Comm_size");
    check(MPI_Bcast(&lowest, 1, MPI_INT, 0, shared), "MPI_Bcast");
    check(MPI_Comm_free(&shared), "MPI_Comm_free");
    auto firsts = allgather(lowest);
    std::ranges::sort(firsts);
    firsts.erase(std::unique(firsts.begin(), firsts.end()), firsts.end());
    here.nodes = int(firsts.size());
    here.node = int(std::ranges::lower_bound(firsts, lowest) - firsts.begin());
    return here;
}

} // namespace kuzure
