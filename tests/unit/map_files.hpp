#pragma once
// A scratch folder for files of the map, and GDAL's tools on them: what tests of rasters and of vectors share.
#include "io/ground/crs.hpp"
#include "solver/core/ensure.hpp"
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <string>
#include <unistd.h>

namespace kuzure::io {

/// Skips where kuzure is built without the libraries of [terrain].
class MapFiles : public ::testing::Test {
protected:
    void SetUp() override
    {
        if (!has_terrain()) GTEST_SKIP() << "built without maps";
        std::filesystem::create_directories(folder);
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    Path file(const std::string& name) const { return folder / name; }
    void write(const std::string& name, const std::string& text) const { std::ofstream(file(name), std::ios::binary) << text; }
    static std::string bytes(const Path& path)
    {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    /// What a command printed, after "failed: " where it failed.
    std::string said_by(const std::string& command) const
    {
        const int code = std::system((command + " > " + file("said.txt").string() + " 2>&1").c_str());
        return (code == 0 ? "" : "failed: ") + bytes(file("said.txt"));
    }
    static bool gdal() { return std::system("gdalinfo --version > /dev/null 2>&1") == 0; }
    Path folder = std::filesystem::temp_directory_path() / fmt::format("kuzure-map-{}", ::getpid());
};

} // namespace kuzure::io
