// GSI's elevation models: JPGIS (GML) in XML, one mesh a file, or zips of them.
#include "io/ground/formats.hpp"
#if KUZURE_TERRAIN
#include "io/ground/crs.hpp"
#include "io/ground/text.hpp"
#include "io/trim.hpp"
#include <algorithm>
#include <archive.h>
#include <archive_entry.h>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <pugixml.hpp>
#endif

namespace kuzure::io::ground {

#if KUZURE_TERRAIN
namespace {

constexpr std::uint64_t most_bytes = std::uint64_t(1) << 30;

struct Mesh {
    scene::Grid grid; // with values
    std::string crs;
};

/// The first element of this name, whatever its namespace, in document order.
pugi::xml_node find(const pugi::xml_node& in, std::string_view name)
{
    return in.find_node([&](const pugi::xml_node& n) {
        std::string_view called = n.name();
        if (const auto colon = called.find(':'); colon != called.npos) called.remove_prefix(colon + 1);
        return called == name;
    });
}

std::array<double, 2> two(const pugi::xml_node& in, const char* name, const std::string& file)
{
    const auto node = find(in, name);
    const std::string text = node.child_value();
    std::array<double, 2> v;
    const char *from = text.data(), *const end = from + text.size();
    for (double& x : v) {
        while (from < end && std::isspace((unsigned char)(*from))) ++from;
        const auto [next, error] = std::from_chars(from, end, x);
        if (error != std::errc() || !std::isfinite(x))
            throw BadInput(
                fmt::format("{}: expected two numbers in <{}>, found \"{}\". Remedy: download it again", file, name, text.substr(0, 60)));
        from = next;
    }
    return v;
}

std::string crs_of(const pugi::xml_node& coverage, const std::string& file)
{
    const std::string system = find(coverage, "Envelope").attribute("srsName").value();
    if (system.find("jgd2011") != system.npos || system.find("jgd2024") != system.npos) return crs_from("EPSG:6668", file);
    if (system.find("jgd2000") != system.npos) return crs_from("EPSG:4612", file);
    throw BadInput(fmt::format("{}: expected latitude and longitude in fguuid:jgd2011.bl or jgd2000.bl, found \"{}\". Remedy: download the "
                               "elevation model anew (fgd.gsi.go.jp)",
                               file, system));
}

/// The cells of a mesh, without heights.
scene::Grid grid_of(const pugi::xml_node& coverage, const std::string& file)
{
    // Latitude first.
    const auto low = two(coverage, "lowerCorner", file), high = two(coverage, "upperCorner", file);
    const auto first = two(coverage, "low", file), last = two(coverage, "high", file);
    const double columns = last[0] - first[0] + 1, rows = last[1] - first[1] + 1;
    if (!(columns >= 1 && rows >= 1 && columns * rows < 1e8) || columns != std::floor(columns) || rows != std::floor(rows))
        throw BadInput(fmt::format("{}: expected whole numbers of columns and rows, found {} x {}", file, columns, rows));
    const double dx = (high[1] - low[1]) / columns, dy = (high[0] - low[0]) / rows;
    if (!(dx > 0 && dy > 0) || std::abs(dx - dy) * std::max(columns, rows) > 0.1 * dx)
        throw BadInput(
            fmt::format("{}: its cells of {} x {} degrees are not square. Remedy: download it again, the corners ({} {}, {} {}) are not "
                        "those of {} x {} cells",
                        file, dx, dy, low[0], low[1], high[0], high[1], columns, rows));
    scene::Grid grid = grid_at(low[1], low[0], rounded_cell(dx, true), std::int64_t(columns), std::int64_t(rows), file);
    grid.values.assign(std::size_t(columns * rows), std::numeric_limits<double>::quiet_NaN());
    return grid;
}

/// The cell of the first value, counted from the north-west row by row.
std::size_t first_cell(const pugi::xml_node& coverage, const scene::Grid& grid, const std::string& file)
{
    const int columns = grid.columns, rows = grid.rows;
    const auto rule = find(coverage, "sequenceRule");
    const std::string order = rule.attribute("order").value();
    if (order != "+x-y")
        throw BadInput(fmt::format(
            "{}: expected values in the order \"+x-y\", from the north-west row by row, found \"{}\". Remedy: download it again", file,
            order));
    const auto start = two(coverage, "startPoint", file);
    if (!(start[0] >= 0 && start[1] >= 0 && start[0] < columns && start[1] < rows) || start[0] != std::floor(start[0]) ||
        start[1] != std::floor(start[1]))
        throw BadInput(fmt::format("{}: its startPoint {} {} lies outside its {} x {} cells. Remedy: download it again", file, start[0],
                                   start[1], columns, rows));
    return std::size_t(start[1]) * std::size_t(columns) + std::size_t(start[0]);
}

/// The height of a line "type,height", where it has one.
std::optional<double> height_of(const std::string& line, const std::string& where)
{
    const auto comma = line.find(',');
    if (comma == line.npos) throw BadInput(where + ": expected a type, a comma and a height. Remedy: download it again");
    const std::string type = trimmed(line.substr(0, comma)), number = trimmed(line.substr(comma + 1));
    double x = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), x);
    if (error != std::errc() || end != number.data() + number.size() || !std::isfinite(x))
        throw BadInput(where + ": expected a height after the comma. Remedy: download it again");
    bool known = false;
    for (const char* word : {"地表面", "表層面", "海水面", "内水面", "その他", "データなし", "海水底面", "内水底面"})
        known = known || type == word;
    if (!known)
        throw BadInput(fmt::format(
            "{}: expected 地表面, 表層面, 海水面, 内水面, その他 or データなし, found \"{}\". Remedy: download it again", where, type));
    if (type == "データなし" || !(x > -9998)) return {};
    return single(x);
}

/// One mesh; nothing where the file is no elevation model.
std::optional<Mesh> mesh_of(const std::string& bytes, const std::string& file)
{
    const auto text = as_utf8(bytes);
    pugi::xml_document document;
    const auto result = document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!result)
        throw BadInput(
            fmt::format("{}: cannot be read as XML: {} at byte {}. Remedy: download it again", file, result.description(), result.offset));
    const auto coverage = find(document, "coverage");
    const auto list = find(coverage, "tupleList");
    if (!coverage || !list) return {};

    Mesh m;
    m.crs = crs_of(coverage, file);
    m.grid = grid_of(coverage, file);
    const auto columns = std::size_t(m.grid.columns), cells = m.grid.values.size(), first = first_cell(coverage, m.grid, file);
    std::size_t at = first;
    const std::string_view all = list.child_value();
    for (std::size_t from = 0, given = 0; from < all.size();) {
        const auto to = std::min(all.find('\n', from), all.size());
        const auto line = trimmed(all.substr(from, to - from));
        from = to + 1;
        if (line.empty()) continue;
        ++given;
        const std::string where = fmt::format("{}: value {} (\"{}\")", file, given, line.substr(0, 60));
        if (at >= cells)
            throw BadInput(fmt::format(
                "{}: its list is longer than its grid: {} x {} cells from startPoint {} {} are full. Remedy: download it again, or "
                "convert it with another tool and look at it",
                where, columns, m.grid.rows, first % columns, first / columns));
        if (const auto height = height_of(line, where)) m.grid.at(int(at % columns), m.grid.rows - 1 - int(at / columns)) = *height;
        ++at;
    }
    return m;
}

struct CloseArchive {
    void operator()(archive* a) const { archive_read_free(a); }
};

/// Every elevation model in a zip, and in zips in it.
void meshes_of_zip(const std::string& bytes, const std::string& file, int depth, std::uint64_t& total, std::vector<Mesh>& to)
{
    const std::unique_ptr<archive, CloseArchive> a(archive_read_new());
    archive_read_support_format_zip(a.get());
    const auto broken = [&] {
        const char* why = archive_error_string(a.get());
        return BadInput(fmt::format("{}: cannot be read as a zip: {}. Remedy: download it again", file, why ? why : "no reason given"));
    };
    if (archive_read_open_memory(a.get(), bytes.data(), bytes.size()) != ARCHIVE_OK) throw broken();
    for (int number = 1;; ++number) {
        archive_entry* entry = nullptr;
        const int code = archive_read_next_header(a.get(), &entry);
        if (code == ARCHIVE_EOF) return;
        if (code < ARCHIVE_WARN) throw broken();
        const char* name = archive_entry_pathname(entry);
        const auto called = fmt::format("{} ({})", file, name ? as_utf8(name) : fmt::format("entry {}", number));
        std::string content;
        std::string buffer(1 << 18, '\0');
        for (;;) {
            const auto n = archive_read_data(a.get(), buffer.data(), buffer.size());
            if (n < 0) throw broken();
            if (n == 0) break;
            total += std::uint64_t(n);
            if (total > 4 * most_bytes)
                throw BadInput(
                    fmt::format("{}: unpacked it is larger than 4 GiB. Remedy: fewer meshes at once, as a list of files", called));
            content.append(buffer.data(), std::size_t(n));
        }
        if (content.starts_with("PK\x03\x04") && depth < 2) meshes_of_zip(content, called, depth + 1, total, to);
        else if (content.find("<?xml") < 8)
            if (auto m = mesh_of(content, called)) to.push_back(std::move(*m));
    }
}

std::vector<Mesh> meshes(const Path& path)
{
    const auto file = path.string();
    const auto bytes = read_text(path, most_bytes);
    std::vector<Mesh> all;
    if (bytes.starts_with("PK")) {
        std::uint64_t total = 0;
        meshes_of_zip(bytes, file, 0, total, all);
        if (all.empty())
            throw BadInput(fmt::format(
                "{}: no elevation model of GSI (.xml with a coverage) in this zip. Remedy: the files FG-GML-*-dem*.zip of fgd.gsi.go.jp",
                file));
    } else if (auto m = mesh_of(bytes, file)) {
        all.push_back(std::move(*m));
    } else {
        throw BadInput(
            fmt::format("{}: expected an elevation model of GSI, found XML without a coverage and its tupleList. Remedy: the files "
                        "FG-GML-*-dem*.xml of fgd.gsi.go.jp",
                        file));
    }
    for (const auto& m : all)
        if (m.grid.cell != all[0].grid.cell || m.crs != all[0].crs)
            throw BadInput(fmt::format(
                "{}: its meshes have cells of {:.4g} and {:.4g} seconds of arc, or two systems. Remedy: give each kind as a file of its "
                "own: dem = [\"first.zip\", \"second.zip\"]",
                file, 3600 * all[0].grid.cell, 3600 * m.grid.cell));
    return all;
}

/// The grid that holds all meshes, without values.
scene::Grid around(const std::vector<Mesh>& all)
{
    Window w = extent_of(all[0].grid);
    for (const auto& m : all) {
        const Window o = extent_of(m.grid);
        w = {std::min(w.low_x, o.low_x), std::min(w.low_y, o.low_y), std::max(w.high_x, o.high_x), std::max(w.high_y, o.high_y)};
    }
    const double cell = all[0].grid.cell;
    return grid_at(w.low_x, w.low_y, cell, std::llround((w.high_x - w.low_x) / cell), std::llround((w.high_y - w.low_y) / cell), "meshes");
}

} // namespace

RasterInfo jpgis_info(const Path& path)
{
    const auto all = meshes(path);
    return {"GSI JPGIS", around(all), all[0].crs, -9999, fmt::format("text, {} mesh{}", all.size(), all.size() == 1 ? "" : "es")};
}

Raster read_jpgis(const Path& path, const std::optional<Window>& window)
{
    const auto all = meshes(path);
    const scene::Grid whole = around(all);
    const Part part = part_of(whole, window, path.string());
    Raster r{crop(whole, part), all[0].crs};
    if (part.empty()) return r;
    for (const auto& m : all) {
        const auto column = std::llround((m.grid.x - r.grid.x) / whole.cell), row = std::llround((m.grid.y - r.grid.y) / whole.cell);
        for (int j = 0; j < m.grid.rows; ++j)
            for (int i = 0; i < m.grid.columns; ++i) {
                const auto to_i = column + i, to_j = row + j;
                if (to_i < 0 || to_j < 0 || to_i >= r.grid.columns || to_j >= r.grid.rows) continue;
                double& to = r.grid.at(int(to_i), int(to_j));
                if (std::isnan(to)) to = m.grid.at(i, j);
            }
    }
    return r;
}

#else
RasterInfo jpgis_info(const Path&) { return {}; }
Raster read_jpgis(const Path&, const std::optional<Window>&) { return {}; }
#endif

} // namespace kuzure::io::ground
