#pragma once
// HDF5 as the other files of io/ need it: tables of rows written by all ranks together and read by one at a time,
// every failure an IoFailed in words. No HDF5 type shows here, and the library never prints.
#include "io/file.hpp"
#include <map>
#include <vector>

namespace kuzure::io {

class HdfDisk;

/// The HDF5 library reports to us and not to the terminal, and does no clean-up of its own when the program or MPI ends (after a damaged
/// file it crashes there). To be called before MPI starts.
void quiet_hdf5();

/// Name and version of the HDF5 library.
std::string hdf5_library();

/// Number types a table may hold.
enum class Number { Float64, Int64, Int32, UInt8 };
template <class T> inline constexpr Number stored_as = Number::Float64;
template <> inline constexpr Number stored_as<std::int64_t> = Number::Int64;
template <> inline constexpr Number stored_as<std::int32_t> = Number::Int32;
template <> inline constexpr Number stored_as<std::uint8_t> = Number::UInt8;
std::size_t bytes_of(Number);

/// A new HDF5 file, written by all ranks of a team together. Rank 0 lays out the file by the HDF5 library, which works in memory;
/// then each rank writes its own rows where they belong, and rank 0 HDF5's structures. Not through MPI-IO: on a full disk Open MPI's
/// loses data without a word or hangs (tests/mpi/io_test.cpp), while the system's own calls say what failed on the
/// rank where it did. All calls are collective and in the same order. Failures may be collected; table() and
/// finish() throw IoFailed, on all ranks.
class H5Writer {
public:
    /// Creates `file`.tmp; `bytes` (all ranks together, roughly) are asked of the disk beforehand.
    H5Writer(const Team&, const Place& file, std::uint64_t bytes);
    /// Closes; a file that was not finished is removed.
    ~H5Writer();
    H5Writer(const H5Writer&) = delete;
    H5Writer& operator=(const H5Writer&) = delete;

    void group(const std::string& name);
    /// On a group or table; rank 0's value counts. Text is stored with fixed length.
    void attribute(const std::string& object, const std::string& name, double);
    void attribute(const std::string& object, const std::string& name, std::int64_t);
    void attribute(const std::string& object, const std::string& name, std::span<const std::int64_t>);
    void attribute(const std::string& object, const std::string& name, std::string_view);

    /// A table of this rank's rows after those of lower ranks; one component gives a one-dimensional table.
    template <class T> void table(const std::string& name, std::span<const T> mine, int components)
    {
        write(name, stored_as<T>, mine.data(), mine.size() / std::size_t(components), components);
    }
    /// Close and bring to the disk. The file is then whole and still named `temporary()`.
    void finish();
    /// finish(), then give the file its name.
    void publish();
    const Place& temporary() const { return temporary_; }

private:
    void write(const std::string& name, Number, const void* rows, std::size_t count, int components);
    void write_attribute(const std::string& object, const std::string& name, std::int64_t type, std::int64_t count, const void*);
    void check(bool ok, const std::string& doing);
    void close_and_remove();

    const Team& team_;
    Place file_, temporary_;
    std::string complaint_;         // the first of this rank
    Descriptor descriptor_;         // all ranks: the file as the system has it open
    std::unique_ptr<HdfDisk> disk_; // rank 0: the file as HDF5 sees it
    std::int64_t id_ = -1;          // and has it open
    bool finished_ = false;
};

/// An HDF5 file read by this rank alone; it stays the one that was opened, also where another gets its name. Trusts nothing: a table is
/// looked at before memory is taken for it, links are not followed.
/// Not collective; throws IoFailed on this rank only (see agree()).
class H5Reader {
public:
    explicit H5Reader(const Place& file);
    ~H5Reader();
    H5Reader(const H5Reader&) = delete;
    H5Reader& operator=(const H5Reader&) = delete;

    struct Table {
        Number number;
        std::uint64_t rows;
        int components;
    };
    bool has(const std::string& name) const;
    /// The names in a group, in order of the alphabet.
    std::vector<std::string> names(const std::string& group) const;
    bool has_attribute(const std::string& object, const std::string& attribute) const;
    /// Refuses tables that are larger than the file, of unknown types, or stored in a way kuzure does not write.
    Table table(const std::string& name) const;
    /// Rows first .. first+count-1 of a table of T with that many components.
    template <class T>
    void rows(const std::string& name, std::uint64_t first, std::uint64_t count, int components, std::vector<T>& into) const
    {
        check_rows(name, stored_as<T>, first, count, components);
        into.resize(std::size_t(count) * std::size_t(components));
        read(name, stored_as<T>, first, count, components, into.data());
    }
    double real(const std::string& object, const std::string& attribute) const;
    std::int64_t integer(const std::string& object, const std::string& attribute) const;
    std::string text(const std::string& object, const std::string& attribute) const;
    const Place& file() const { return file_; }
    [[noreturn]] void refuse(const std::string& why) const;

private:
    void check_rows(const std::string& name, Number, std::uint64_t first, std::uint64_t count, int components) const;
    void read(const std::string& name, Number, std::uint64_t first, std::uint64_t count, int components, void* into) const;

    Place file_;
    Descriptor descriptor_;
    std::unique_ptr<HdfDisk> disk_;
    std::int64_t id_ = -1;
    std::uint64_t file_bytes_ = 0;
    mutable std::map<std::string, Table> seen_; // tables that were looked at and found in order
};

} // namespace kuzure::io
