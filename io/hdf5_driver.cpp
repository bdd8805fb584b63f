#include "io/hdf5_driver.hpp"
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#if H5_VERSION_GE(1, 13, 0)
#include <H5FDdevelop.h>
#endif

namespace kuzure::io {

std::uint64_t HdfDisk::end()
{
    if (truncated_ || !written_.empty()) return end_;
    struct stat info;
    return ::fstat(descriptor_, &info) == 0 ? std::uint64_t(info.st_size) : 0;
}

bool HdfDisk::read(std::uint64_t at, std::size_t count, void* into)
{
    char* to = static_cast<char*>(into);
    for (std::size_t have = 0; have < count;) {
        const auto n = ::pread(descriptor_, to + have, count - have, off_t(at + have));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            error_ = errno;
            return false;
        }
        if (n == 0) { // behind the end there are zeros
            std::memset(to + have, 0, count - have);
            break;
        }
        have += std::size_t(n);
    }
    for (const auto& [start, bytes] : written_) {
        const auto first = std::max(at, start), last = std::min<std::uint64_t>(at + count, start + bytes.size());
        if (first < last) std::memcpy(to + (first - at), bytes.data() + (first - start), std::size_t(last - first));
    }
    return true;
}

void HdfDisk::write(std::uint64_t at, std::size_t count, const void* from)
{
    // What it overlaps or touches becomes one piece with it: few writes to the disk, of each byte the last.
    std::uint64_t first = at, last = at + count;
    auto begin = written_.upper_bound(at);
    if (begin != written_.begin() && std::prev(begin)->first + std::prev(begin)->second.size() >= at) --begin;
    auto end = begin;
    for (; end != written_.end() && end->first <= at + count; ++end)
        first = std::min(first, end->first), last = std::max<std::uint64_t>(last, end->first + end->second.size());
    std::vector<std::byte> whole(last - first);
    for (auto p = begin; p != end; ++p) std::copy(p->second.begin(), p->second.end(), whole.begin() + std::ptrdiff_t(p->first - first));
    std::memcpy(whole.data() + (at - first), from, count);
    written_.erase(begin, end);
    written_.emplace(first, std::move(whole));
    end_ = std::max(end_, at + count);
}

int HdfDisk::write_out()
{
    for (const auto& [start, bytes] : written_)
        if (const int error = write_all(descriptor_, bytes.data(), bytes.size(), std::int64_t(start))) return error;
    return ::ftruncate(descriptor_, off_t(end_)) == 0 ? 0 : errno;
}

FileIdentity HdfDisk::identity() const
{
    struct stat info;
    return ::fstat(descriptor_, &info) == 0 ? FileIdentity{info.st_dev, info.st_ino} : FileIdentity{};
}

namespace {

/// A file that HDF5 has open.
struct Opened {
    H5FD_t base; // first: HDF5 knows the file by it
    HdfDisk* disk;
    haddr_t allocated;
};
Opened& opened(H5FD_t* f) { return *reinterpret_cast<Opened*>(f); }
const Opened& opened(const H5FD_t* f) { return *reinterpret_cast<const Opened*>(f); }

// HDF5 is C: nothing may be thrown through it.
H5FD_t* open(const char*, unsigned, hid_t access, haddr_t)
{
    const auto* disk = static_cast<HdfDisk* const*>(H5Pget_driver_info(access));
    return disk ? reinterpret_cast<H5FD_t*>(new (std::nothrow) Opened{{}, *disk, 0}) : nullptr;
}
herr_t close(H5FD_t* f)
{
    delete &opened(f);
    return 0;
}
int compare(const H5FD_t* a, const H5FD_t* b)
{
    const auto x = opened(a).disk->identity(), y = opened(b).disk->identity();
    if (x == y) return 0;
    return x.device < y.device || (x.device == y.device && x.number < y.number) ? -1 : 1;
}
herr_t query(const H5FD_t*, unsigned long* flags)
{
    if (flags)
        *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE | H5FD_FEAT_AGGREGATE_SMALLDATA |
                 H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
    return 0;
}
haddr_t allocated(const H5FD_t* f, H5FD_mem_t) { return opened(f).allocated; }
herr_t allocate(H5FD_t* f, H5FD_mem_t, haddr_t end)
{
    opened(f).allocated = end;
    return 0;
}
haddr_t end(const H5FD_t* f, H5FD_mem_t) { return opened(f).disk->end(); }
herr_t read(H5FD_t* f, H5FD_mem_t, hid_t, haddr_t at, std::size_t count, void* into)
{
    return opened(f).disk->read(at, count, into) ? 0 : -1;
}
herr_t write(H5FD_t* f, H5FD_mem_t, hid_t, haddr_t at, std::size_t count, const void* from)
{
    try {
        opened(f).disk->write(at, count, from);
        return 0;
    } catch (const std::bad_alloc&) {
        return -1;
    }
}
herr_t truncate(H5FD_t* f, hid_t, hbool_t)
{
    if (!(opened(f).base.access_flags & H5F_ACC_RDWR)) return 0;
    opened(f).disk->set_end(opened(f).allocated);
    return 0;
}

hid_t driver()
{
    static const H5FD_class_t ours = [] {
        H5FD_class_t c{};
#if H5_VERSION_GE(1, 13, 0)
        c.version = H5FD_CLASS_VERSION;
        c.value = H5FD_class_value_t(600); // of the range for drivers that are not registered with the HDF Group
#endif
        c.name = "kuzure";
        c.maxaddr = haddr_t(std::numeric_limits<off_t>::max());
        c.fc_degree = H5F_CLOSE_WEAK;
        c.fapl_size = sizeof(HdfDisk*);
        c.open = open, c.close = close, c.cmp = compare, c.query = query;
        c.get_eoa = allocated, c.set_eoa = allocate, c.get_eof = end;
        c.read = read, c.write = write, c.truncate = truncate;
        const H5FD_mem_t kinds[] = H5FD_FLMAP_DICHOTOMY;
        std::copy(std::begin(kinds), std::end(kinds), c.fl_map);
        return c;
    }();
    static const hid_t id = H5FDregister(&ours);
    return id;
}

} // namespace

hid_t HdfDisk::access()
{
    quiet_hdf5();
    const hid_t list = H5Pcreate(H5P_FILE_ACCESS);
    HdfDisk* self = this;
    // Formats since 1.8 carry checksums of their metadata. Locks fail on NFS and Lustre without flock.
    if (list < 0 || driver() < 0 || H5Pset_driver(list, driver(), &self) < 0 ||
        H5Pset_libver_bounds(list, H5F_LIBVER_V18, H5F_LIBVER_LATEST) < 0 || H5Pset_file_locking(list, false, true) < 0)
        throw IoFailed("HDF5 does not take kuzure's file driver: it is of a version that kuzure does not know");
    return list;
}

void quiet_hdf5()
{
    static const int told = H5dont_atexit(); // before any other call
    static const herr_t started = H5open();
    if (told >= 0 && started >= 0) H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

} // namespace kuzure::io
