#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include "io/json.hpp"
#include <algorithm>
#include <bit>
#include <cstring>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

using nlohmann::json;

constexpr int format_version = 2;
constexpr const char* format_name = "kuzure checkpoint";
// Of a result directory; the unnamed one is newer than the previous where a crash fell between the two renames.
constexpr const char *newest_name = "checkpoint.h5", *unnamed_name = "checkpoint.h5.tmp", *previous_name = "checkpoint.prev.h5";
constexpr std::uint64_t rows_at_a_time = 1 << 17; // while reading
constexpr std::uint64_t longest_text = 64 << 20;  // bytes of manifest or header

// ---- the checksum
// ---------------------------------------------------------------------------------------------------- A sum
// over rows of a hash of (row number, row): the same for any split of the rows over ranks, wrong for rows swapped.
std::uint64_t mix(std::uint64_t h)
{
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    return h ^ (h >> 32);
}
template <class T> std::uint64_t word(T v)
{
    if constexpr (sizeof(T) == 8) return std::bit_cast<std::uint64_t>(v);
    else return std::uint64_t(std::make_unsigned_t<T>(v));
}
template <class T> std::uint64_t sum_of_rows(std::span<const T> rows, int components, std::uint64_t first)
{
    std::uint64_t sum = 0;
    const auto n = rows.size() / std::size_t(components);
    for (std::size_t i = 0; i < n; ++i) {
        std::uint64_t h = (first + i + 1) * 0x9e3779b97f4a7c15u;
        for (int c = 0; c < components; ++c) h = mix(h ^ word(rows[i * std::size_t(components) + std::size_t(c)]));
        sum += h;
    }
    return sum;
}
/// Modulo 2^64 over all ranks.
std::uint64_t sum_over_ranks(const Team& team, std::uint64_t mine)
{
    std::int64_t halves[2] = {std::int64_t(mine & 0xffffffffu), std::int64_t(mine >> 32)};
    team.sum(std::span<std::int64_t>(halves));
    return std::uint64_t(halves[0]) + (std::uint64_t(halves[1]) << 32);
}
std::uint64_t sum_of_text(std::string_view text)
{
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    return mix(sum_of_rows(bytes, 1, 0) ^ text.size());
}
std::string hex(std::uint64_t v) { return fmt::format("{:016x}", v); }

std::span<const std::uint8_t> bytes_on_root(const Team& team, const std::string& text)
{
    return {reinterpret_cast<const std::uint8_t*>(text.data()), team.rank() == 0 ? text.size() : 0};
}

std::string extra_name(std::string_view table) { return fmt::format("/tables/{}", table); }
std::string table_name(std::string_view field) { return fmt::format("/particles/{}", field); }

// ---- reading --------------------------------------------------------------------------------------------------------
struct FieldEntry {
    std::string name;
    int components;
    std::string checksum;
};
struct TableEntry {
    std::string name;
    std::uint64_t rows;
    int components;
    std::string checksum;
};
struct Manifest {
    std::string text;
    Checkpoint what;
    std::vector<FieldEntry> fields;
    std::vector<TableEntry> tables;
};

std::string read_bytes(const H5Reader& in, const std::string& name)
{
    const auto t = in.table(name);
    if (t.rows > longest_text) in.refuse(fmt::format("table {} is too long for a text ({} bytes)", name, t.rows));
    std::vector<std::uint8_t> bytes;
    in.rows(name, 0, t.rows, 1, bytes);
    return {bytes.begin(), bytes.end()};
}

Manifest read_manifest(const H5Reader& in)
{
    if (!in.has("/manifest")) in.refuse("not a checkpoint of kuzure (it has no /manifest)");
    const std::string text = read_bytes(in, "/manifest");
    if (in.text("/manifest", "checksum") != hex(sum_of_text(text))) in.refuse("damaged: the checksum of /manifest does not fit");
    Manifest m;
    m.text = text;
    try {
        const json all = parse_json(text);
        if (all.at("format") != format_name) in.refuse("not a checkpoint of kuzure");
        if (all.at("version") != format_version)
            in.refuse(fmt::format("checkpoint format {}, this program reads format {}: use the version that wrote it",
                                  all.at("version").dump(), format_version));
        m.what.file = in.file();
        m.what.particles = all.at("particles").get<std::int64_t>();
        m.what.scene_hash = all.at("scene_hash").get<std::string>();
        for (const auto& f : all.at("fields"))
            m.fields.push_back({f.at("name").get<std::string>(), f.at("components").get<int>(), f.at("checksum").get<std::string>()});
        if (all.contains("tables"))
            for (const auto& t : all.at("tables"))
                m.tables.push_back({t.at("name").get<std::string>(), t.at("rows").get<std::uint64_t>(), t.at("components").get<int>(),
                                    t.at("checksum").get<std::string>()});
        m.what.header = read_bytes(in, "/header");
        if (all.at("header_checksum") != hex(sum_of_text(m.what.header))) in.refuse("damaged: the checksum of /header does not fit");
    } catch (const json::exception& e) {
        in.refuse(fmt::format("damaged: /manifest does not say what it should ({})", e.what()));
    }
    if (m.what.particles < 0) in.refuse("damaged: a negative number of particles");
    return m;
}

/// Collective. Each rank reads for itself: where one finds damage, none may be waiting inside the library.
template <class Work> void guarded_on(const Team& team, const Place& file, const Work& work)
{
    std::string complaint;
    try {
        work();
    } catch (const IoFailed& e) {
        complaint = e.what();
    } catch (const std::bad_alloc&) {
        complaint = fmt::format("{}: not enough memory to read it: use more ranks on more nodes", file.string());
    }
    agree(team, complaint);
}

/// A rank's contiguous share of rows.
struct Share {
    std::uint64_t first, count;
    Share(const Team& team, std::uint64_t total)
    {
        const auto ranks = std::uint64_t(team.size()), me = std::uint64_t(team.rank());
        first = total / ranks * me + std::min(me, total % ranks);
        count = total / ranks + (me < total % ranks ? 1 : 0);
    }
};

/// Collective: reads this rank's share of a table and checks all of it; keeps the rows in `into` if there is one.
void read_table(const Team& team, const H5Reader& in, const TableEntry& t, std::vector<double>* into)
{
    const std::string name = extra_name(t.name);
    std::uint64_t sum = 0;
    guarded_on(team, in.file(), [&] {
        const auto found = in.table(name);
        if (found.rows != t.rows || found.components != t.components || t.components < 1)
            in.refuse(
                fmt::format("damaged: table {} is {} x {}, expected {} x {}", name, found.rows, found.components, t.rows, t.components));
        const Share mine(team, t.rows);
        std::vector<double> rows;
        for (std::uint64_t at = 0; at < mine.count; at += rows_at_a_time) {
            const auto n = std::min(rows_at_a_time, mine.count - at);
            in.rows(name, mine.first + at, n, t.components, rows);
            sum += sum_of_rows(std::span<const double>(rows), t.components, mine.first + at);
            if (into) into->insert(into->end(), rows.begin(), rows.end());
        }
    });
    sum = sum_over_ranks(team, sum);
    guarded_on(team, in.file(), [&] {
        if (hex(sum) != t.checksum) in.refuse(fmt::format("damaged: the checksum of {} does not fit", name));
    });
}

/// Before memory is taken: every table has the rows and columns that the manifest names, and every field is known; `into` gets them.
void check_tables(const H5Reader& in, const Manifest& m, Particles* into)
{
    const auto total = std::uint64_t(m.what.particles);
    for (const auto& f : m.fields)
        if (const auto t = in.table(table_name(f.name)); t.rows != total || t.components != f.components)
            in.refuse(fmt::format("damaged: table {} is {} x {}, expected {} x {}", table_name(f.name), t.rows, t.components, total,
                                  f.components));
    std::size_t known = 0;
    std::apply(
        [&](auto... f) {
            (std::for_each(m.fields.begin(), m.fields.end(),
                           [&](const FieldEntry& e) {
                               if (e.name != f.name) return;
                               if (e.components != f.components)
                                   in.refuse(fmt::format("field {} has {} components, expected {}", f.name, e.components, f.components));
                               ++known;
                               if (into) into->require(f);
                           }),
             ...);
        },
        AllFields{});
    if (known != m.fields.size()) in.refuse("holds fields this version of kuzure does not know: use the version that wrote it");
    if (!into) return;
    into->for_each_present([&](auto f) {
        if (std::none_of(m.fields.begin(), m.fields.end(), [&](const FieldEntry& e) { return e.name == f.name; }))
            in.refuse(fmt::format("lacks the field '{}', which this run needs: the scene's effects have changed", f.name));
    });
}

/// Reads and checks this rank's rows of a field that the file has.
template <class Field>
void read_field(const Team& team, const H5Reader& in, const Manifest& m, std::uint64_t first, std::uint64_t count, Field f, Particles* into)
{
    using T = typename decltype(f)::Number;
    const auto entry = std::find_if(m.fields.begin(), m.fields.end(), [&](const FieldEntry& e) { return e.name == f.name; });
    if (entry == m.fields.end()) return;
    std::uint64_t sum = 0;
    guarded_on(team, in.file(), [&] {
        std::vector<T> rows;
        for (std::uint64_t at = 0; at < count; at += rows_at_a_time) {
            const auto n = std::min(rows_at_a_time, count - at);
            in.rows(table_name(f.name), first + at, n, f.components, rows);
            sum += sum_of_rows(std::span<const T>(rows), f.components, first + at);
            if (!into) continue;
            const auto view = (*into)[f];
            for (std::uint64_t i = 0; i < n; ++i)
                for (int c = 0; c < f.components; ++c) view.column[c][at + i] = rows[i * f.components + c];
        }
    });
    sum = sum_over_ranks(team, sum);
    guarded_on(team, in.file(), [&] {
        if (hex(sum) != entry->checksum) in.refuse(fmt::format("damaged: the checksum of {} does not fit", table_name(f.name)));
    });
}

/// Reads and checks the rows of this rank, field by field; keeps them in `into` if there is one.
Checkpoint read_all(const Team& team, const Place& file, std::shared_ptr<const H5Reader> in, Particles* into)
{
    const auto guarded = [&](const auto& work) { guarded_on(team, file, work); };
    Manifest m;
    std::uint64_t first = 0, count = 0;
    guarded([&] {
        if (!in) in = std::make_shared<const H5Reader>(file);
        m = read_manifest(*in);
    });
    // Where its owner writes a new one meanwhile, each rank may have opened another.
    const std::string first_says = team.broadcast(m.text);
    guarded([&] {
        if (m.text != first_says) in->refuse("it was replaced by another while it was being opened: start again");
    });
    guarded([&] {
        const Share mine(team, std::uint64_t(m.what.particles));
        first = mine.first, count = mine.count;
        if (count > std::uint64_t(std::numeric_limits<Index>::max()) - 2 * Particles::padding)
            in->refuse(fmt::format("{} particles are too many for {} ranks", m.what.particles, team.size()));
        check_tables(*in, m, into);
        if (!into) return;
        into->resize(0);
        into->resize(Index(count));
    });
    try {
        std::apply([&](auto... f) { (read_field(team, *in, m, first, count, f, into), ...); }, AllFields{});
        if (!into)
            for (const auto& t : m.tables) read_table(team, *in, t, nullptr);
    } catch (...) {
        if (into) into->resize(0);
        throw;
    }
    m.what.opened = std::move(in);
    return m.what;
}

} // namespace

std::uint64_t checkpoint_bytes(std::int64_t particles, std::size_t bytes_per_particle)
{
    return std::uint64_t(particles) * bytes_per_particle + (1 << 17); // the rows, and some for the library
}

Place write_checkpoint(const Team& team, const Place& directory, const Particles& p, const std::string& scene_hash,
                       const std::string& header, std::span<const CheckpointTable> tables)
{
    Place file = directory / newest_name;
    const Place previous = directory / previous_name;
    try {
        const std::int64_t total = team.sum(std::int64_t(p.size()));
        const auto first = std::uint64_t(team.sum_below(std::int64_t(p.size())));
        std::int64_t further = 0; // bytes
        for (const auto& t : tables) further += std::int64_t(t.rows.size() * sizeof(double));
        further = team.sum(further);
        H5Writer out(team, file, checkpoint_bytes(total, p.bytes_per_particle()) + std::uint64_t(further));
        out.group("/particles");
        json manifest = {{"format", format_name},    {"version", format_version}, {"particles", total},
                         {"scene_hash", scene_hash}, {"fields", json::array()},   {"header_checksum", hex(sum_of_text(header))}};
        p.for_each_present([&](auto f) {
            using T = typename decltype(f)::Number;
            const auto view = p[f];
            const auto n = std::size_t(p.size());
            std::vector<T> rows(n * f.components);
            for (std::size_t i = 0; i < n; ++i)
                for (int c = 0; c < f.components; ++c) rows[i * f.components + std::size_t(c)] = view.column[c][i];
            const std::span<const T> mine(rows);
            out.table(table_name(f.name), mine, f.components);
            out.attribute(table_name(f.name), "unit", f.unit);
            const auto sum = sum_over_ranks(team, sum_of_rows(mine, f.components, first));
            manifest["fields"].push_back({{"name", f.name}, {"components", f.components}, {"checksum", hex(sum)}});
        });
        if (!tables.empty()) out.group("/tables");
        for (const auto& t : tables) {
            const auto n = std::int64_t(t.rows.size()) / t.components;
            const auto before = std::uint64_t(team.sum_below(n));
            const std::span<const double> mine(t.rows);
            out.table(extra_name(t.name), mine, t.components);
            out.attribute(extra_name(t.name), "unit", t.unit);
            const auto sum = sum_over_ranks(team, sum_of_rows(mine, t.components, before));
            manifest["tables"].push_back({{"name", t.name}, {"rows", team.sum(n)}, {"components", t.components}, {"checksum", hex(sum)}});
        }
        out.table("/header", bytes_on_root(team, header), 1);
        const std::string text = manifest.dump(1);
        out.table("/manifest", bytes_on_root(team, text), 1);
        out.attribute("/manifest", "checksum", hex(sum_of_text(text)));
        out.finish();
        on_root(team, [&] {
            if (exists(file)) move_file(file, previous);
            move_file(out.temporary(), file);
            sync(directory);
        });
    } catch (const IoFailed& e) {
        std::string good;
        if (team.rank() == 0)
            for (const auto& candidate : {previous, file})
                if (exists(candidate)) good = candidate.string();
        good = team.broadcast(good);
        throw CheckpointFailed(good.empty() ? fmt::format("{}. No checkpoint was written before this one", e.what())
                                            : fmt::format("{}. The last good checkpoint is {}", e.what(), good));
    }
    return file;
}

Place keep_generation(const Team& team, const Checkpoint& good)
{
    const Place directory = directory_of(good.file), newest = directory / newest_name;
    const bool unnamed = good.file.name() == unnamed_name, older = good.file.name() == previous_name;
    if (unnamed || older)
        on_root(team, [&] {
            if (exists(newest)) move_file(newest, directory / "checkpoint.aside.h5");
            if (unnamed) move_file(good.file, newest);
            sync(directory);
        });
    return unnamed ? newest : good.file;
}

Checkpoint read_checkpoint(const Team& team, const Place& file, Particles& into) { return read_all(team, file, {}, &into); }
void read_checkpoint(const Team& team, const Checkpoint& verified, Particles& into)
{
    read_all(team, verified.file, verified.opened, &into);
}

std::optional<std::vector<double>> read_checkpoint_table(const Team& team, const Checkpoint& from, const std::string& name, int components)
{
    Manifest m;
    guarded_on(team, from.file, [&] { m = read_manifest(*from.opened); });
    const auto t = std::ranges::find(m.tables, name, &TableEntry::name);
    if (t == m.tables.end()) return {};
    std::vector<double> rows;
    guarded_on(team, from.file, [&] {
        if (t->components != components)
            from.opened->refuse(fmt::format("table {} has {} components, expected {}", extra_name(name), t->components, components));
    });
    read_table(team, *from.opened, *t, &rows);
    return rows;
}

Checkpoint verify_checkpoint(const Team& team, const Place& file) { return read_all(team, file, {}, nullptr); }

std::optional<Checkpoint> newest_good(const Team& team, const Place& directory, const std::function<void(const std::string&)>& say)
{
    std::vector<std::string> passed_over;
    for (const char* name : {newest_name, unnamed_name, previous_name}) {
        const Place file = directory / name;
        if (!team.any(team.rank() == 0 && exists(file))) continue;
        const bool half_written = file.path().extension() == ".tmp";
        try {
            Checkpoint good = verify_checkpoint(team, file);
            for (const auto& why : passed_over)
                if (team.rank() == 0) say(fmt::format("{}. Going back to {}", why, file.string()));
            return good;
        } catch (const IoFailed& e) {
            if (!half_written) passed_over.emplace_back(e.what());
        }
    }
    if (passed_over.empty()) return {};
    std::string all;
    for (const auto& why : passed_over) all += why + ". ";
    throw IoFailed(all + "No good checkpoint is left: run from the start with --force");
}

} // namespace kuzure::io
