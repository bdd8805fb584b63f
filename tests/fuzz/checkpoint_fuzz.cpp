// Any bytes are a checkpoint or a refusal in words. The first byte of the input chooses what the others are:
//   0  a whole file;
//   1  changes of a good checkpoint: triples (offset, offset, value), with which most of the file's structures stand;
//   2  the manifest of a file whose checksums are right, up to a zero byte, then the header: what lies behind them.
// Built for libFuzzer (-DKUZURE_FUZZ=ON), and for the replay of the corpus in the normal suite (replay_test.cpp).
#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include "tests/fuzz/fuzz.hpp"
#include <bit>
#include <fmt/format.h>
#include <map>

using namespace kuzure;
using namespace kuzure::fuzz;

// HDF5's own; hdf5.h is for io/ only. How much of what it gave back it may keep for the next use, -1 for all.
extern "C" int H5set_free_list_limits(int, int, int, int, int, int);
// The checksum of HDF5's metadata.
extern "C" std::uint32_t H5_checksum_metadata(const void*, std::size_t, std::uint32_t);

namespace {

const SingleRank alone;

Particles seven()
{
    Particles p;
    p.require(field::velocity, field::stress, field::density, field::soil);
    p.resize(7);
    p.for_each_present([&](auto f) {
        using T = typename decltype(f)::Number;
        for (int c = 0; c < f.components; ++c)
            for (Index i = 0; i < 7; ++i) p[f].column[c][i] = T(i + 10 * c);
    });
    return p;
}

std::uint64_t mix(std::uint64_t h)
{
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    return h ^ (h >> 32);
}
/// The checksum of io/checkpoint.cpp for a text; where the two part, mode 2 only finds refusals, and the self-check says so.
std::string checksum(std::string_view text)
{
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < text.size(); ++i)
        sum += mix((std::uint64_t(i) + 1) * 0x9e3779b97f4a7c15u ^ std::uint64_t(static_cast<unsigned char>(text[i])));
    return fmt::format("{:016x}", mix(sum ^ text.size()));
}

/// A file with this manifest, its checksum right, over the tables of seven particles.
std::string file_with(const io::Path& file, const std::string& manifest, const std::string& header)
{
    const auto bytes = [](const std::string& s) {
        return std::span<const std::uint8_t>(reinterpret_cast<const std::uint8_t*>(s.data()), s.size());
    };
    const Particles p = seven();
    io::H5Writer out(alone, file, 0);
    out.group("/particles");
    p.for_each_present([&](auto f) {
        using T = typename decltype(f)::Number;
        std::vector<T> rows;
        for (Index i = 0; i < 7; ++i)
            for (int c = 0; c < f.components; ++c) rows.push_back(p[f].column[c][i]);
        out.table(fmt::format("/particles/{}", f.name), std::span<const T>(rows), f.components);
    });
    out.table("/header", bytes(header), 1);
    out.table("/manifest", bytes(manifest), 1);
    out.attribute("/manifest", "checksum", checksum(manifest));
    out.publish();
    return io::read_text(file);
}

/// Files made by file_with() for texts of one length, into which other texts of that length are put. Writing each with HDF5
/// would take as long as reading it.
class Template {
public:
    Template(const io::Path& scratch, std::size_t manifest, std::size_t header)
    {
        const std::string m(manifest, '\1'), h(header, '\2'), sum = checksum(m);
        bytes_ = file_with(scratch / "template.h5", m, h);
        const auto place = [&](const std::string& text) {
            const auto at = text.empty() ? 0 : bytes_.find(text);
            if (at == bytes_.npos || (!text.empty() && bytes_.find(text, at + 1) != bytes_.npos)) found("a text has no place in the file");
            return at;
        };
        manifest_ = place(m), header_ = place(h), sum_ = place(sum);
        // The piece of metadata that holds the manifest's checksum has one of its own at its end.
        piece_ = std::max(bytes_.rfind("OHDR", sum_) + 1, bytes_.rfind("OCHK", sum_) + 1) - 1;
        for (end_ = sum_ + sum.size(); end_ + 4 <= bytes_.size(); ++end_)
            if (bytes_.compare(end_, 4, own_checksum()) == 0) return;
        found("the checksum of the manifest's object header is not where it should be");
    }
    std::string with(std::string_view manifest, std::string_view header)
    {
        bytes_.replace(manifest_, manifest.size(), manifest);
        bytes_.replace(header_, header.size(), header);
        const auto sum = checksum(manifest);
        bytes_.replace(sum_, sum.size(), sum);
        bytes_.replace(end_, 4, own_checksum());
        return bytes_;
    }

private:
    std::string own_checksum() const
    {
        const std::uint32_t sum = H5_checksum_metadata(bytes_.data() + piece_, end_ - piece_, 0);
        return {reinterpret_cast<const char*>(&sum), 4};
    }
    std::string bytes_;
    std::size_t manifest_, header_, sum_, piece_, end_;
};

/// As file_with(), the texts filled up by blanks to a whole number of this many bytes, so that few templates serve all.
std::string filled_with(const io::Path& scratch, std::string manifest, std::string header)
{
    const std::size_t whole = 32;
    const auto fill = [&](std::string& text) { text.resize((text.size() + whole - 1) / whole * whole, ' '); };
    fill(manifest), fill(header);
    static std::map<std::pair<std::size_t, std::size_t>, Template> templates;
    if (templates.size() > 4000) templates.clear();
    const auto sizes = std::pair(manifest.size(), header.size());
    return templates.try_emplace(sizes, scratch, manifest.size(), header.size()).first->second.with(manifest, header);
}

/// What reading says: empty if the file is good.
std::string refusal(const io::Path& file)
{
    try {
        Particles p;
        const auto c = io::read_checkpoint(alone, file, p);
        if (p.size() != Index(c.particles)) found("another number of particles than the checkpoint says");
        return {};
    } catch (const IoFailed& e) {
        const std::string message = e.what();
        if (message.empty() || message.size() > 100000) found("a refusal of no words, or of too many");
        return message;
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    static const Scratch scratch;
    static const std::string good = [] {
        io::write_checkpoint(alone, scratch.path, seven(), "hash", "{\"time\": 0.5}");
        // Each file takes half a megabyte of the library's: mapped and cleared anew, that is most of the time of an input.
        if (H5set_free_list_limits(-1, -1, -1, -1, -1, -1) < 0) found("HDF5 does not keep its memory");
        const auto file = scratch.path / "checkpoint.h5";
        if (!refusal(file).empty()) found("the good checkpoint is refused");
        // The self-check of mode 2: with its own manifest again the file passes the checksum of the manifest.
        std::vector<std::uint8_t> manifest;
        const io::H5Reader in(file);
        in.rows("/manifest", 0, in.table("/manifest").rows, 1, manifest);
        const std::string text(manifest.begin(), manifest.end()), header = "{\"time\": 0.5}";
        const auto again = scratch.path / "again.h5";
        file_with(again, text, header);
        if (const auto why = refusal(again); !why.empty()) std::fprintf(stderr, "%s\n", why.c_str()), found("mode 2 makes no good file");
        Template piece(scratch.path, text.size(), header.size());
        for (int k = 0; k < 2; ++k) {
            write(again, piece.with(text, header));
            if (const auto why = refusal(again); !why.empty())
                std::fprintf(stderr, "%s\n", why.c_str()), found("a template makes no good file");
            piece.with(std::string(text.size(), 'x'), std::string(header.size(), 'x'));
        }
        return io::read_text(file);
    }();
    if (size == 0 || size > (1 << 20)) return 0;
    const std::string_view body(reinterpret_cast<const char*>(data) + 1, size - 1);
    const auto file = scratch.path / "input.h5";
    switch (data[0] % 3) {
    case 0:
        write(file, body);
        break;
    case 1: {
        std::string changed = good;
        for (std::size_t k = 0; k + 2 < body.size(); k += 3) {
            const auto byte = [&](std::size_t i) { return std::size_t(static_cast<unsigned char>(body[k + i])); };
            changed[(byte(0) * 256 + byte(1)) % changed.size()] = body[k + 2];
        }
        write(file, changed);
        break;
    }
    default: {
        const auto end = body.find('\0');
        write(file, filled_with(scratch.path, std::string(body.substr(0, end)), end == body.npos ? "" : std::string(body.substr(end + 1))));
    }
    }
    refusal(file);
    return 0;
}
