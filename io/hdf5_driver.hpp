#pragma once
// The file driver under HDF5: the library works on a file that is already open, reads it itself, and never writes to a disk. What it
// would write is kept here and brought to the disk by the caller: HDF5 does not bear a write that fails (it crashes at its clean-up).
#include "io/file.hpp"
#include <hdf5.h>
#include <map>

namespace kuzure::io {

/// A file as HDF5 sees it.
class HdfDisk {
public:
    /// Reads this open file, or keeps what is written to it. The descriptor stays the caller's and open as long as HDF5 has the file.
    explicit HdfDisk(int descriptor) : descriptor_(descriptor) {}
    HdfDisk(const HdfDisk&) = delete;

    /// An access list for H5Fcreate and H5Fopen; the caller gives it back. Throws IoFailed.
    hid_t access();
    /// Brings to the disk what HDF5 has written, and sets the file's length. 0 or the errno.
    int write_out();
    /// The errno of a read that failed, or 0.
    int error() const { return error_; }

    // The driver's side.
    std::uint64_t end();
    void set_end(std::uint64_t end) { end_ = end, truncated_ = true; }
    bool read(std::uint64_t at, std::size_t count, void* into);
    void write(std::uint64_t at, std::size_t count, const void* from);
    FileIdentity identity() const;

private:
    int descriptor_, error_ = 0;
    bool truncated_ = false;                                  // end_ counts, not the file's own length
    std::uint64_t end_ = 0;                                   // while writing
    std::map<std::uint64_t, std::vector<std::byte>> written_; // by offset; pieces neither overlap nor touch
};

/// The HDF5 library from here on reports to us and not to the terminal, and does no clean-up when the program or MPI ends: every file is
/// closed long before, and after a file that was damaged the clean-up crashes. To be called before MPI starts, or else
/// HDF5 has MPI call it.
void quiet_hdf5();

} // namespace kuzure::io
