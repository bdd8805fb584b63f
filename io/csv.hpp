#pragma once
// Tables of text as other programs write them: a first line of column names, cells between commas or semicolons.
#include "io/file.hpp"
#include <optional>
#include <string>
#include <vector>

namespace kuzure::io {

struct Csv {
    struct Row {
        int line; // of the file, from 1
        std::vector<std::string> cells;
    };
    std::string file;
    std::vector<std::string> header; // in lower case; empty where the file has no line
    std::vector<Row> rows;           // each with as many cells as the header
    int lines = 0;                   // of the file
    int header_line = 0;

    /// Throws BadInput with file and line.
    [[noreturn]] void refuse(int line, const std::string& what) const;
    /// The number of a column; nothing where the file does not have it.
    std::optional<std::size_t> column(const std::string& name) const;
};

/// Lines that are empty or begin with # are passed over. `expected`: what the file should be, for messages. Throws BadInput.
Csv read_csv(const Path&, const std::string& expected);
/// A finite number that fills its cell.
std::optional<double> csv_number(const std::string& cell);

} // namespace kuzure::io
