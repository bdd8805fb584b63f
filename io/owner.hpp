#pragma once
// One writer for a directory: a file that tells who it is, made by O_EXCL, so that it holds where file locks do not (NFS, Lustre).
#include "io/file.hpp"
#include <optional>

namespace kuzure::io {

/// A process, as others can tell whether it still is.
struct Owner {
    std::string host, boot, pid_namespace; // the last two: the same kernel sees the same processes
    std::int64_t pid = 0, started = 0;     // clock ticks after boot
    std::string job;                       // "Slurm job 12", or empty
    std::int64_t restarts = 0;             // of a job that the batch system requeued
    std::string since;                     // UTC
    std::uint64_t directory = 0;           // number of the directory it owns: a copy of it has no owner

    static Owner self();
    /// Host, process, job, since when.
    std::string words() const;
};

/// The right to write into a held directory, for as long as this lives. Of one process of the run: its rank 0.
class Ownership {
public:
    static constexpr const char* file_name = "kuzure.lock";
    /// What the refusal of a directory that another run writes into says.
    static constexpr const char* refusal = "another run writes into this directory";
    static constexpr int beat_seconds = 10, dead_after_seconds = 120;

    /// Takes a directory that no process owns, or whose owner is dead. A process of the same machine is known by its number and start; one
    /// of another by its heartbeat, which is waited for up to two minutes (`say` gets a sentence then), or by its batch job, if that was
    /// requeued as this one. Throws BadInput naming a living owner and the remedy, IoFailed where the file system fails.
    Ownership(const Place& directory, const std::function<void(const std::string&)>& say);
    Ownership(const Ownership&) = delete;
    /// Gives it back.
    ~Ownership();

    /// True once another process's name stands there, which took this one for dead while it was halted: nothing may be written any more.
    /// Looks anew, and makes the file again where a hand removed it. Throws IoFailed.
    bool lost() const;

    /// Throws BadInput naming the owner if one lives, as far as one reading tells. Changes nothing.
    static void refuse_if_owned(const Place& directory);
    /// Whether a file in a directory belongs to this class.
    static bool is_lock(std::string_view name) { return name.starts_with(file_name); }

private:
    struct Heart;
    bool stands() const;
    Place directory_, file_;
    std::string mine_; // what stands in it; not the file's number, which the next file may get
    std::unique_ptr<Heart> heart_;
};

} // namespace kuzure::io
