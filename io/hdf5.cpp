#include "io/hdf5.hpp"
#include "io/hdf5_driver.hpp"
#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace kuzure::io {
namespace {

static_assert(sizeof(hid_t) == sizeof(std::int64_t));

/// An HDF5 identifier that gives itself back.
class Handle {
public:
    Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle()
    {
        if (id_ >= 0) close_(id_);
    }
    operator hid_t() const { return id_; }
    bool ok() const { return id_ >= 0; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

hid_t native(Number n)
{
    switch (n) {
    case Number::Float64:
        return H5T_NATIVE_DOUBLE;
    case Number::Int64:
        return H5T_NATIVE_INT64;
    case Number::Int32:
        return H5T_NATIVE_INT32;
    case Number::UInt8:
        return H5T_NATIVE_UINT8;
    }
    throw Broken("a number type that HDF5 is not told about");
}

/// What the library has to say about its last failure: the words of the innermost call and the errno in them, if any.
struct Complaint {
    std::string words;
    int error = 0;
};
Complaint last_complaint()
{
    Complaint c;
    H5Ewalk2(
        H5E_DEFAULT, H5E_WALK_UPWARD,
        [](unsigned depth, const H5E_error2_t* e, void* out) -> herr_t {
            if (depth == 0 && e->desc) static_cast<Complaint*>(out)->words = e->desc;
            return 0;
        },
        &c);
    const std::string key = "errno = ";
    if (const auto at = c.words.find(key); at != std::string::npos) c.error = std::atoi(c.words.c_str() + at + key.size());
    return c;
}

} // namespace

std::size_t bytes_of(Number n)
{
    switch (n) {
    case Number::Float64:
    case Number::Int64:
        return 8;
    case Number::Int32:
        return 4;
    case Number::UInt8:
        return 1;
    }
    return 8;
}

// ---- writing -------------------------------------------------------------------------------------------
void H5Writer::check(bool ok, const std::string& doing)
{
    if (ok || !complaint_.empty()) return;
    const Complaint c = last_complaint();
    complaint_ = fmt::format("{}: {} failed: {}{}", file_.string(), doing, cause(file_, c.error),
                             c.words.empty() ? "" : fmt::format(" (HDF5: {})", c.words));
}

H5Writer::H5Writer(const Team& team, const Place& file, std::uint64_t bytes)
    : team_(team), file_(file), temporary_(file.beside(file.name() + ".tmp"))
{
    on_root(team, [&] {
        // Better known beforehand than half way through.
        const auto free = free_bytes(directory_of(file));
        if (free < bytes)
            throw IoFailed(fmt::format("{}: the disk is full: {:.1f} MB are needed and {:.1f} MB are free: make room or choose "
                                       "another directory with -o, then go on with --restart",
                                       file.string(), double(bytes) / 1e6, double(free) / 1e6));
        descriptor_ = create_file(temporary_);
        if (descriptor_ < 0) throw IoFailed(fmt::format("{}: creating the file failed: {}", file.string(), cause(file, errno)));
    });
    try {
        std::string trouble;
        if (team.rank() == 0) {
            // The room is taken beforehand: better a disk that is full now than one that is full in the middle. File systems that cannot
            // do that go without.
            if (bytes > 0 && ::fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, off_t(bytes)) != 0)
                if (const int error = errno; error == ENOSPC || error == EDQUOT || error == EFBIG)
                    trouble = fmt::format("{}: taking {:.1f} MB failed: {}", file_.string(), double(bytes) / 1e6, cause(file_, error));
            disk_ = std::make_unique<HdfDisk>(descriptor_);
            const Handle access(disk_->access(), H5Pclose);
            id_ = H5Fcreate(temporary_.string().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
            check(id_ >= 0, "creating the file");
            if (trouble.empty()) trouble = complaint_;
        } else {
            descriptor_ = open_file(temporary_, O_WRONLY);
            if (descriptor_ < 0) trouble = fmt::format("{}: opening failed: {}", temporary_.string(), cause(file_, errno));
        }
        agree(team, trouble);
    } catch (...) {
        close_and_remove();
        throw;
    }
}

H5Writer::~H5Writer() { close_and_remove(); }

void H5Writer::close_and_remove()
{
    if (id_ >= 0) H5Fclose(id_);
    id_ = -1;
    descriptor_.close();
    if (!finished_ && team_.rank() == 0) ::unlinkat(temporary_.from(), temporary_.relative(), 0);
    finished_ = true;
}

void H5Writer::group(const std::string& name)
{
    if (team_.rank() != 0) return;
    const Handle made(H5Gcreate2(id_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    check(made.ok(), "creating group " + name);
}

void H5Writer::write_attribute(const std::string& object, const std::string& name, std::int64_t type, std::int64_t count, const void* value)
{
    const hsize_t n = hsize_t(count);
    const Handle space(count ? H5Screate_simple(1, &n, nullptr) : H5Screate(H5S_SCALAR), H5Sclose);
    const Handle a(H5Acreate_by_name(id_, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    check(a.ok() && H5Awrite(a, type, value) >= 0, fmt::format("writing attribute {} of {}", name, object));
}
void H5Writer::attribute(const std::string& object, const std::string& name, double v)
{
    if (team_.rank() == 0) write_attribute(object, name, H5T_NATIVE_DOUBLE, 0, &v);
}
void H5Writer::attribute(const std::string& object, const std::string& name, std::int64_t v)
{
    if (team_.rank() == 0) write_attribute(object, name, H5T_NATIVE_INT64, 0, &v);
}
void H5Writer::attribute(const std::string& object, const std::string& name, std::span<const std::int64_t> v)
{
    if (team_.rank() == 0) write_attribute(object, name, H5T_NATIVE_INT64, std::int64_t(v.size()), v.data());
}
void H5Writer::attribute(const std::string& object, const std::string& name, std::string_view v)
{
    if (team_.rank() != 0) return;
    const std::string text = v.empty() ? std::string(1, '\0') : std::string(v);
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type, text.size());
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    write_attribute(object, name, type, 0, text.data());
}

void H5Writer::write(const std::string& name, Number number, const void* rows, std::size_t count, int components)
{
    const std::int64_t first = team_.sum_below(std::int64_t(count)), total = team_.sum(std::int64_t(count));
    const std::size_t row = bytes_of(number) * std::size_t(components);

    // Rank 0 makes the table and knows where in the file its rows lie; HDF5 itself writes nothing there.
    std::int64_t start = 0; // negative: failed
    if (team_.rank() == 0) {
        const hsize_t size[2] = {hsize_t(total), hsize_t(components)};
        const Handle space(H5Screate_simple(components > 1 ? 2 : 1, size, nullptr), H5Sclose);
        const Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
        H5Pset_layout(create, H5D_CONTIGUOUS);
        H5Pset_alloc_time(create, H5D_ALLOC_TIME_EARLY);
        H5Pset_fill_time(create, H5D_FILL_TIME_NEVER);
        const Handle table(H5Dcreate2(id_, name.c_str(), native(number), space, H5P_DEFAULT, create, H5P_DEFAULT), H5Dclose);
        check(table.ok(), "creating table " + name);
        const haddr_t offset = table.ok() && total > 0 ? H5Dget_offset(table) : 0;
        check(offset != HADDR_UNDEF, "placing table " + name);
        start = complaint_.empty() ? std::int64_t(offset) : -1;
    }
    team_.broadcast(std::as_writable_bytes(std::span(&start, 1)));
    if (start < 0) agree(team_, complaint_);
    if (!complaint_.empty()) return; // all ranks get it in finish()

    if (const int error = write_all(descriptor_, rows, count * row, start + first * std::int64_t(row)))
        complaint_ = fmt::format("{}: writing table {} failed: {}", file_.string(), name, cause(file_, error));
}

void H5Writer::finish()
{
    if (finished_) return;
    const auto sync_mine = [&] {
        if (complaint_.empty() && ::fsync(descriptor_) != 0)
            complaint_ = fmt::format("{}: bringing it to the disk failed: {}", file_.string(), cause(file_, errno));
    };
    sync_mine(); // each rank its own writes: on a network file system no other rank can
    agree(team_, complaint_);
    if (team_.rank() == 0) {
        const hid_t id = id_;
        id_ = -1;
        check(H5Fclose(id) >= 0, "closing");
        // HDF5's own structures; room that was taken and not used goes back.
        if (const int error = complaint_.empty() ? disk_->write_out() : 0)
            complaint_ = fmt::format("{}: writing its structure failed: {}", file_.string(), cause(file_, error));
        sync_mine();
    }
    agree(team_, complaint_);
    descriptor_.close();
    finished_ = true;
}

void H5Writer::publish()
{
    finish();
    on_root(team_, [&] {
        move_file(temporary_, file_);
        sync(directory_of(file_));
    });
}

// ---- reading --------------------------------------------------------------------------------------------------------
void H5Reader::refuse(const std::string& why) const { throw IoFailed(fmt::format("{}: {}", file_.string(), why)); }

H5Reader::H5Reader(const Place& file) : file_(file)
{
    // A pipe would wait for a writer.
    descriptor_ = open_file(file, O_RDONLY | O_NONBLOCK);
    if (descriptor_ < 0) refuse(errno == ENOENT ? "there is no such file" : "opening failed: " + cause(file, errno));
    struct stat info;
    if (::fstat(descriptor_, &info) != 0) refuse("asking for its size failed: " + cause(file, errno));
    if (!S_ISREG(info.st_mode)) refuse("expected a file, found something else");
    file_bytes_ = std::uint64_t(info.st_size);
    disk_ = std::make_unique<HdfDisk>(descriptor_);
    const Handle access(disk_->access(), H5Pclose);
    id_ = H5Fopen(file.string().c_str(), H5F_ACC_RDONLY, access);
    if (id_ < 0) {
        if (disk_->error()) refuse("reading failed: " + cause(file, disk_->error()));
        const auto c = last_complaint();
        refuse(fmt::format("not a readable HDF5 file: damaged, cut short or of another kind ({} bytes; HDF5: {})", file_bytes_, c.words));
    }
}

H5Reader::~H5Reader()
{
    // Where HDF5 cannot close a damaged file, it may still ask for it: it gets zeros and no crash.
    if (id_ >= 0 && H5Fclose(id_) < 0) static_cast<void>(disk_.release());
}

bool H5Reader::has(const std::string& name) const
{
    for (auto slash = name.find('/', 1);; slash = name.find('/', slash + 1)) {
        const std::string part = name.substr(0, slash);
        if (H5Lexists(id_, part.c_str(), H5P_DEFAULT) <= 0) return false;
        // Links to other names and other files: not ours, and they lead out of the file.
        H5L_info_t link;
        if (H5Lget_info(id_, part.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD)
            refuse(fmt::format("{} is a link to elsewhere, which kuzure neither writes nor follows", part));
        if (slash == std::string::npos) return true;
    }
}

std::vector<std::string> H5Reader::names(const std::string& group) const
{
    std::vector<std::string> all;
    hsize_t at = 0;
    const auto take = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
    };
    if (!has(group) || H5Literate_by_name(id_, group.c_str(), H5_INDEX_NAME, H5_ITER_INC, &at, take, &all, H5P_DEFAULT) < 0)
        refuse(fmt::format("group {} is missing or damaged", group));
    return all;
}

bool H5Reader::has_attribute(const std::string& object, const std::string& attribute) const
{
    return H5Aexists_by_name(id_, object.c_str(), attribute.c_str(), H5P_DEFAULT) > 0;
}

H5Reader::Table H5Reader::table(const std::string& name) const
{
    if (const auto seen = seen_.find(name); seen != seen_.end()) return seen->second;
    if (!has(name)) refuse(fmt::format("table {} is missing: not a file of this kind, or damaged", name));
    const Handle data(H5Dopen2(id_, name.c_str(), H5P_DEFAULT), H5Dclose);
    if (!data.ok()) refuse(fmt::format("table {} is damaged (HDF5: {})", name, last_complaint().words));
    const Handle space(H5Dget_space(data), H5Sclose), type(H5Dget_type(data), H5Tclose), create(H5Dget_create_plist(data), H5Pclose);
    hsize_t size[2] = {0, 1};
    const int rank = space.ok() ? H5Sget_simple_extent_ndims(space) : -1;
    if (rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space, size, nullptr) < 0)
        refuse(fmt::format("table {} has {} dimensions, expected 1 or 2", name, rank));
    Table t{};
    bool known = false;
    for (const Number n : {Number::Float64, Number::Int64, Number::Int32, Number::UInt8})
        if (H5Tequal(type, native(n)) > 0) t.number = n, known = true;
    if (!known) refuse(fmt::format("table {} holds numbers of a type kuzure does not write", name));
    if (size[1] < 1 || size[1] > 64) refuse(fmt::format("table {} has {} columns", name, size[1]));
    t.rows = size[0];
    t.components = int(size[1]);
    const auto row = bytes_of(t.number) * size[1];
    if (t.rows > file_bytes_ / row) refuse(fmt::format("table {} claims {} rows of {} bytes, more than the file holds", name, t.rows, row));

    // What could lead out of the file or blow up in memory (filters, chunks, links to other files): not ours.
    const auto layout = H5Pget_layout(create);
    const bool ours = layout == H5D_CONTIGUOUS && H5Pget_external_count(create) == 0;
    if (!ours) refuse(fmt::format("table {} is stored in a way kuzure does not write", name));
    seen_.emplace(name, t);
    return t;
}

void H5Reader::check_rows(const std::string& name, Number number, std::uint64_t first, std::uint64_t count, int components) const
{
    const Table t = table(name);
    if (t.number != number || t.components != components)
        refuse(fmt::format("table {} has {} columns or another number type than the {} expected", name, t.components, components));
    if (first > t.rows || count > t.rows - first)
        refuse(fmt::format("table {} has {} rows, fewer than the {} expected", name, t.rows, first + count));
}

void H5Reader::read(const std::string& name, Number number, std::uint64_t first, std::uint64_t count, int components, void* into) const
{
    if (count == 0) return;
    const int rank = components > 1 ? 2 : 1;
    const hsize_t start[2] = {first, 0}, size[2] = {count, hsize_t(components)};
    const Handle data(H5Dopen2(id_, name.c_str(), H5P_DEFAULT), H5Dclose), in_file(H5Dget_space(data), H5Sclose),
        in_memory(H5Screate_simple(rank, size, nullptr), H5Sclose);
    if (H5Sget_simple_extent_ndims(in_file) != rank || H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start, nullptr, size, nullptr) < 0 ||
        H5Dread(data, native(number), in_memory, in_file, H5P_DEFAULT, into) < 0) {
        if (disk_->error()) refuse(fmt::format("reading table {} failed: {}", name, cause(file_, disk_->error())));
        refuse(fmt::format("table {} cannot be read: damaged (HDF5: {})", name, last_complaint().words));
    }
}

double H5Reader::real(const std::string& object, const std::string& attribute) const
{
    double v = 0;
    if (!has(object)) refuse(object + " is missing: not a file of this kind, or damaged");
    const Handle a(H5Aopen_by_name(id_, object.c_str(), attribute.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const Handle space(a.ok() ? H5Aget_space(a) : -1, H5Sclose);
    if (!space.ok() || H5Sget_simple_extent_npoints(space) != 1 || H5Aread(a, H5T_NATIVE_DOUBLE, &v) < 0)
        refuse(fmt::format("attribute {} of {} is missing or damaged", attribute, object));
    return v;
}

std::int64_t H5Reader::integer(const std::string& object, const std::string& attribute) const
{
    std::int64_t v = 0;
    if (!has(object)) refuse(object + " is missing: not a file of this kind, or damaged");
    const Handle a(H5Aopen_by_name(id_, object.c_str(), attribute.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const Handle space(a.ok() ? H5Aget_space(a) : -1, H5Sclose);
    if (!space.ok() || H5Sget_simple_extent_npoints(space) != 1 || H5Aread(a, H5T_NATIVE_INT64, &v) < 0)
        refuse(fmt::format("attribute {} of {} is missing or damaged", attribute, object));
    return v;
}

std::string H5Reader::text(const std::string& object, const std::string& attribute) const
{
    if (!has(object)) refuse(object + " is missing: not a file of this kind, or damaged");
    const Handle a(H5Aopen_by_name(id_, object.c_str(), attribute.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const Handle type(a.ok() ? H5Aget_type(a) : -1, H5Tclose), space(a.ok() ? H5Aget_space(a) : -1, H5Sclose);
    const bool plain = type.ok() && space.ok() && H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0 &&
                       H5Sget_simple_extent_npoints(space) == 1 && H5Tget_size(type) <= 65536;
    std::string v(plain ? H5Tget_size(type) : 0, '\0');
    if (!plain || H5Aread(a, type, v.data()) < 0)
        refuse(fmt::format("attribute {} of {} is missing, damaged or not a short text", attribute, object));
    v.resize(std::min(v.find('\0'), v.size()));
    return v;
}

std::string hdf5_library()
{
    quiet_hdf5();
    unsigned major = 0, minor = 0, release = 0;
    H5get_libversion(&major, &minor, &release);
    return fmt::format("HDF5 {}.{}.{}", major, minor, release);
}

} // namespace kuzure::io
