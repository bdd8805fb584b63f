// ESRI ASCII grids.
#include "io/ground/crs.hpp"
#include "io/ground/formats.hpp"
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fcntl.h>
#include <fmt/format.h>
#include <map>
#include <unistd.h>

namespace kuzure::io::ground {
namespace {

/// The words of a file, one after the other, without holding the file.
class Words {
public:
    explicit Words(const Path& path) : path_(path), in_(open_file(path, O_RDONLY | O_NONBLOCK)), buffer_(1 << 20, '\0')
    {
        if (in_ < 0) throw IoFailed(fmt::format("{}: cannot be opened: {}", path.string(), cause(path, errno)));
    }
    /// Empty at the end.
    std::string_view next()
    {
        word_.clear();
        for (;; ++at_) {
            if (at_ == have_ && !more()) return word_;
            const char c = buffer_[at_];
            if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',') {
                if (!word_.empty()) return word_;
                if (c == '\n') ++line_;
            } else {
                if (word_.size() > 400)
                    throw BadInput(fmt::format("{}:{}: expected numbers, found a word of hundreds of characters", path_.string(), line_));
                word_ += c;
            }
        }
    }
    int line() const { return line_; }

private:
    bool more()
    {
        const auto n = ::read(in_, buffer_.data(), buffer_.size());
        if (n < 0) throw IoFailed(fmt::format("{}: reading: {}", path_.string(), cause(path_, errno)));
        at_ = 0, have_ = std::size_t(n);
        return n > 0;
    }
    Path path_;
    Descriptor in_;
    std::string buffer_, word_;
    std::size_t at_ = 0, have_ = 0;
    int line_ = 1;
};

/// A number, or nothing. "nan" is NaN.
std::optional<double> number(std::string_view word)
{
    if (word.starts_with('+')) word.remove_prefix(1);
    double x;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
    if (error == std::errc() && end == word.data() + word.size()) return x;
    return {};
}

struct Header {
    scene::Grid grid;
    std::optional<double> nodata;
    std::string first; // word after the header
};

Header header(const Path& path, Words& words, bool geographic)
{
    const std::string file = path.string();
    std::map<std::string, double> values;
    Header h;
    for (;;) {
        const auto word = words.next();
        std::string key;
        for (const char c : word) key += char(std::tolower((unsigned char)(c)));
        if (key.empty() || !std::isalpha((unsigned char)(key[0])) || key == "nan") {
            h.first = word;
            break;
        }
        const int line = words.line();
        if (key == "dx" || key == "dy") key = key == "dx" ? "dx" : "dy";
        else if (key != "ncols" && key != "nrows" && key != "xllcorner" && key != "yllcorner" && key != "xllcenter" && key != "yllcenter" &&
                 key != "cellsize" && key != "nodata_value" && key != "nodata")
            throw BadInput(fmt::format("{}:{}: expected ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter, cellsize, "
                                       "NODATA_value; found \"{}\"",
                                       file, line, std::string(word)));
        const std::string said(words.next());
        const auto x = number(said);
        if (!x) throw BadInput(fmt::format("{}:{}: {}: expected a number, found \"{}\"", file, line, key, said));
        if (!values.emplace(key == "nodata" ? "nodata_value" : key, *x).second)
            throw BadInput(fmt::format("{}:{}: {} stands there twice", file, line, key));
    }
    const auto needed = [&](const char* key) {
        if (!values.contains(key))
            throw BadInput(fmt::format("{}: its header has no {}. Remedy: add the line, as the source of the file says", file, key));
        return values[key];
    };
    if (!values.contains("cellsize") && values.contains("dx") && values.contains("dy")) {
        if (values["dx"] != values["dy"])
            throw BadInput(fmt::format("{}: cells of {} x {} are not square. Remedy: gdalwarp -tr SIZE SIZE -r bilinear in.asc out.tif",
                                       file, values["dx"], values["dy"]));
        values["cellsize"] = values["dx"];
    }
    const double columns = needed("ncols"), rows = needed("nrows");
    if (columns != std::floor(columns) || rows != std::floor(rows) || !(columns >= 1 && rows >= 1 && columns < 2e9 && rows < 2e9))
        throw BadInput(fmt::format("{}: expected whole numbers of columns and rows, found {} x {}", file, columns, rows));
    const double cell = rounded_cell(needed("cellsize"), geographic);
    const auto corner = [&](const char* at_corner, const char* at_centre) {
        if (values.contains(at_centre)) {
            if (values.contains(at_corner))
                throw BadInput(fmt::format("{}: its header has both {} and {}. Remedy: leave one out", file, at_corner, at_centre));
            return values[at_centre] - 0.5 * cell;
        }
        return needed(at_corner);
    };
    h.grid =
        grid_at(corner("xllcorner", "xllcenter"), corner("yllcorner", "yllcenter"), cell, std::int64_t(columns), std::int64_t(rows), file);
    if (values.contains("nodata_value")) h.nodata = values["nodata_value"];
    return h;
}

bool geographic(const std::string& crs) { return !crs.empty() && is_geographic(crs); }

} // namespace

RasterInfo ascii_info(const Path& path)
{
    Words words(path);
    const auto crs = crs_beside(path);
    const auto h = header(path, words, geographic(crs));
    return {"ESRI ASCII", h.grid, crs, h.nodata, "text"};
}

Raster read_ascii(const Path& path, const std::optional<Window>& window)
{
    Words words(path);
    const auto crs = crs_beside(path);
    const auto h = header(path, words, geographic(crs));
    const Part part = part_of(h.grid, window, path.string());
    // Before memory is taken for numbers that a small file cannot hold: each has a digit and a blank.
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    const double numbers = double(h.grid.columns) * h.grid.rows;
    if (!error && numbers > 1e6 && double(bytes) < 2 * numbers - 1)
        throw BadInput(
            fmt::format("{}: {} rows of {} numbers were expected, its {} bytes do not hold them. Remedy: it is cut short, copy it "
                        "again; or correct ncols and nrows",
                        path.string(), h.grid.rows, h.grid.columns, bytes));
    Raster r{crop(h.grid, part), crs};
    if (part.empty()) return r;
    const double nodata = h.nodata.value_or(-9999);
    std::string_view word = h.first;
    for (int row = 0; row < h.grid.rows; ++row)
        for (int column = 0; column < h.grid.columns; ++column) {
            if (row > 0 || column > 0) word = words.next();
            if (word.empty())
                throw BadInput(
                    fmt::format("{}: {} rows of {} numbers were expected, the file ends in row {} from the north, column {}. Remedy: it "
                                "is cut short, copy it again",
                                path.string(), h.grid.rows, h.grid.columns, row + 1, column + 1));
            const bool wanted = row >= part.row && row < part.end_row && column >= part.column && column < part.end_column;
            if (!wanted) continue;
            const auto x = number(word);
            if (!x || std::isinf(*x))
                throw BadInput(fmt::format("{}:{}: row {} from the north, column {}: expected a number, found \"{}\"", path.string(),
                                           words.line(), row + 1, column + 1, std::string(word.substr(0, 40))));
            if (*x != nodata && !std::isnan(*x)) r.grid.at(column - part.column, part.end_row - 1 - row) = single(*x);
        }
    if (!words.next().empty())
        throw BadInput(fmt::format("{}:{}: more than {} x {} numbers. Remedy: correct ncols and nrows, or make the file again",
                                   path.string(), words.line(), h.grid.columns, h.grid.rows));
    return r;
}

} // namespace kuzure::io::ground
