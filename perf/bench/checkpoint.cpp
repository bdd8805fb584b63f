// What a checkpoint costs, against the disk's own speed: the state of a real checkpoint, laid side by side until it is so many
// particles, is written as a plain file, as a checkpoint, and read, in turn; then packed by h5repack, if there is one.
//   build/release/bench_checkpoint CHECKPOINT.h5 DIRECTORY [MILLIONS [ROUNDS]]     perf/checkpoint_cost.sh makes the state too
#include "io/checkpoint.hpp"
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <vector>

using namespace kuzure;

namespace {

template <class Work> double timed(Work work)
{
    const auto begin = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// As often side by side as makes at least n; ids go on.
void repeat(Particles& p, Index n)
{
    const Index one = p.size();
    p.resize((n + one - 1) / one * one);
    p.for_each_present([&](auto f) {
        for (auto* column : p[f].column)
            for (Index i = one; i < p.size(); ++i) column[i] = column[i - one];
    });
    for (Index i = one; i < p.size(); ++i) p[field::id].column[0][i] += one * (i / one);
}

/// The bytes as a new file, brought to the disk: what "dd conv=fsync" does.
void write_plainly(const io::Path& file, std::uint64_t bytes)
{
    std::vector<char> block(8 << 20);
    for (std::size_t i = 0; i < block.size(); ++i) block[i] = char(i * 2654435761u >> 13);
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    bool good = fd >= 0;
    for (std::uint64_t left = bytes; good && left > 0;) {
        const auto n = ::write(fd, block.data(), std::size_t(std::min<std::uint64_t>(left, block.size())));
        good = n > 0;
        left -= good ? std::uint64_t(n) : 0;
    }
    good = good && ::fsync(fd) == 0;
    if (fd >= 0) ::close(fd);
    if (!good) throw IoFailed(fmt::format("{}: {}", file.string(), io::cause(file, errno)));
}

void show(const char* what, std::vector<double> seconds, double bytes, double millions)
{
    std::sort(seconds.begin(), seconds.end());
    const double median = seconds[seconds.size() / 2];
    fmt::print("{:34} {:8.3f} {:8.3f} .. {:<8.3f} {:8.1f} {:8.0f}\n", what, median / millions, seconds.front() / millions,
               seconds.back() / millions, bytes / 1e6 / millions, bytes / 1e6 / median);
}

} // namespace

int main(int argc, char** argv)
try {
    if (argc < 3) {
        fmt::print(stderr, "usage: bench_checkpoint CHECKPOINT.h5 DIRECTORY [MILLIONS [ROUNDS]]\n");
        return 2;
    }
    const io::Path directory = argv[2];
    const double wanted = argc > 3 ? std::atof(argv[3]) : 1;
    const int rounds = argc > 4 ? std::max(1, std::atoi(argv[4])) : 5;
    const SingleRank alone;
    Particles p;
    const auto source = io::read_checkpoint(alone, argv[1], p);
    repeat(p, Index(wanted * 1e6));
    const double millions = double(p.size()) / 1e6;
    const auto raw = std::uint64_t(p.size()) * p.bytes_per_particle();
    std::vector<double> plain, written, read;
    io::Path file;
    std::filesystem::create_directories(directory);
    for (int k = 0; k < rounds; ++k) {
        plain.push_back(timed([&] { write_plainly(directory / "plain", raw); }));
        written.push_back(timed([&] { file = io::write_checkpoint(alone, directory, p, source.scene_hash, source.header).path(); }));
        read.push_back(timed([&] { io::verify_checkpoint(alone, file); }));
    }
    fmt::print("{} particles of {} bytes, one rank, {} rounds in turn, in {}\n", p.size(), p.bytes_per_particle(), rounds,
               std::filesystem::absolute(directory).string());
    fmt::print("{:34} {:>8} {:>20} {:>8} {:>8}\n", "per million particles", "s", "s, least .. most", "MB", "MB/s");
    const double size = double(std::filesystem::file_size(file));
    show("the disk: the same bytes, fsync", plain, double(raw), millions);
    show("checkpoint written", written, size, millions);
    show("checkpoint read and verified", read, size, millions);
    const bool packer = std::system("command -v h5repack >/dev/null 2>&1") == 0;
    if (!packer) fmt::print("h5repack is not installed (apt-get install hdf5-tools): nothing packed\n");
    for (const int level : {1, 6}) {
        if (!packer) break;
        const io::Path packed = directory / "packed.h5";
        std::vector<double> seconds;
        const auto command = fmt::format("h5repack -f SHUF -f GZIP={} '{}' '{}' 2>/dev/null", level, file.string(), packed.string());
        for (int k = 0; k < 2; ++k) {
            std::filesystem::remove(packed);
            bool good = false;
            seconds.push_back(timed([&] { good = std::system(command.c_str()) == 0; }));
            if (!good) throw IoFailed("h5repack failed: " + command);
        }
        show(fmt::format("packed by shuffle and deflate {}", level).c_str(), seconds, double(std::filesystem::file_size(packed)), millions);
    }
    for (const char* name : {"plain", "packed.h5", "checkpoint.h5", "checkpoint.prev.h5"}) std::filesystem::remove(directory / name);
    return 0;
} catch (const std::exception& e) {
    fmt::print(stderr, "bench_checkpoint: {}\n", e.what());
    return 4;
}
