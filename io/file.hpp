#pragma once
// Plain files: written whole or not at all, and failures that reach every rank at once. No other file in io/
// opens, renames or syncs a file by hand.
#include "solver/core/ensure.hpp"
#include "solver/core/team.hpp"
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace kuzure::io {

using Path = std::filesystem::path;

/// Collective. If any rank brings a complaint (not empty), all throw IoFailed with the lowest such rank's
/// words.
void agree(const Team&, const std::string& complaint);

/// Collective. Rank 0 works; what it throws (BadInput, IoFailed, anything else as IoFailed) is thrown on
/// every rank.
void on_root(const Team&, const std::function<void()>& work);

/// Bytes an ordinary user may still write where this path lies or will lie.
std::uint64_t free_bytes(const Path&);

/// The words for an errno, with the free space of the file's disk where that is the likely cause.
std::string cause(const Path&, int error);

/// The file gets this content or keeps what it had: written beside it, synced, renamed. Throws IoFailed.
void write_atomically(const Path&, std::string_view content);

/// The same without waiting for the disk: for what can be made again from other files. Throws IoFailed.
void write_lightly(const Path&, std::string_view content);

/// The whole file, at most `limit` bytes. Throws IoFailed.
std::string read_text(const Path&, std::uint64_t limit = std::uint64_t(1) << 30);

/// Wait until the file's (or directory's) content is on the disk. Throws IoFailed.
void sync(const Path&);

/// Rename within a directory, replacing what is there. Throws IoFailed.
void move_file(const Path& from, const Path& to);

/// The directory a file lies in, never empty.
Path directory_of(const Path&);

} // namespace kuzure::io
