// Rasters written and read again: by us, and by GDAL's tools where they are installed.
#include "io/ground/raster.hpp"
#include "tests/unit/map_files.hpp"
#include <cmath>

namespace kuzure::io {
namespace {

using ::testing::HasSubstr;

class Rasters : public MapFiles {
protected:
    static scene::Grid hills(int columns, int rows, double x, double y, double cell)
    {
        scene::Grid g{x, y, cell, columns, rows, {}};
        g.values.resize(std::size_t(columns) * std::size_t(rows));
        for (int j = 0; j < rows; ++j)
            for (int i = 0; i < columns; ++i) g.at(i, j) = double(float(std::round(1e2 * (100 + 0.5 * i + 3 * std::sin(0.3 * j))) / 1e2));
        return g;
    }
    static bool same(const scene::Grid& a, const scene::Grid& b)
    {
        if (a.x != b.x || a.y != b.y || a.cell != b.cell || a.columns != b.columns || a.rows != b.rows) return false;
        for (std::size_t k = 0; k < a.values.size(); ++k)
            if (a.values[k] != b.values[k] && !(std::isnan(a.values[k]) && std::isnan(b.values[k]))) return false;
        return a.values.size() == b.values.size();
    }
    std::string ascii(const scene::Grid& g, bool centre = false, const std::string& nodata = "-9999") const
    {
        const double half = centre ? 0 : 0.5 * g.cell;
        auto text = fmt::format("ncols {}\nnrows {}\n{} {}\n{} {}\ncellsize {}\nNODATA_value -9999\n", g.columns, g.rows,
                                centre ? "xllcenter" : "xllcorner", g.x - half, centre ? "yllcenter" : "yllcorner", g.y - half, g.cell);
        for (int j = g.rows - 1; j >= 0; --j) {
            for (int i = 0; i < g.columns; ++i) text += std::isnan(g.at(i, j)) ? nodata + " " : fmt::format("{:.2f} ", g.at(i, j));
            text += "\r\n";
        }
        return text;
    }
    std::string refusal(const std::string& name) const
    {
        try {
            read_raster(file(name));
        } catch (const BadInput& e) {
            return e.what();
        }
        return "taken";
    }
};

TEST_F(Rasters, WhatWasWrittenIsRead)
{
    Raster r{hills(37, 23, -1500.5, 12000.5, 1), crs_from("EPSG:6670", "test")};
    r.grid.at(3, 4) = NAN;
    write_geotiff(file("a.tif"), r);
    const auto back = read_raster(file("a.tif"));
    EXPECT_TRUE(same(back.grid, r.grid));
    EXPECT_EQ(back.crs, r.crs);
    EXPECT_EQ(geotiff_bytes(r), geotiff_bytes(r));
    const auto info = raster_info(file("a.tif"));
    EXPECT_EQ(info.format, "GeoTIFF");
    EXPECT_EQ(info.nodata, -9999);
    EXPECT_EQ(info.numbers, "float32");
    EXPECT_EQ(crs_name(info.crs), "JGD2011 / Japan Plane Rectangular CS II (EPSG:6670)");
}

TEST_F(Rasters, TheSameGridAsTextHasTheSameBits)
{
    Raster r{hills(37, 23, -1500.9, 12000.3, 0.2), crs_from("EPSG:6670", "test")};
    r.grid.at(3, 4) = NAN;
    write_geotiff(file("a.tif"), r);
    write("corner.asc", ascii(r.grid));
    write("corner.prj", esri_wkt(r.crs));
    write("centre.asc", ascii(r.grid, true, "nan"));
    const auto tif = read_raster(file("a.tif"));
    const auto corner = read_raster(file("corner.asc")), centre = read_raster(file("centre.asc"));
    EXPECT_TRUE(same(tif.grid, corner.grid));
    EXPECT_TRUE(same(tif.grid, centre.grid));
    EXPECT_EQ(corner.crs, r.crs);
    EXPECT_EQ(centre.crs, "");
}

TEST_F(Rasters, AWindowIsAPartOfTheWhole)
{
    const Raster r{hills(60, 50, 100.5, 200.5, 1), ""};
    write_geotiff(file("a.tif"), r);
    write("a.asc", ascii(r.grid));
    for (const char* name : {"a.tif", "a.asc"}) {
        const auto part = read_raster(file(name), Window{110, 210.5, 120, 220}).grid;
        EXPECT_EQ(part.columns, 10);
        EXPECT_EQ(part.rows, 10);
        EXPECT_EQ(part.x, 110.5);
        EXPECT_EQ(part.y, 210.5);
        EXPECT_EQ(part.at(0, 0), r.grid.at(10, 10));
        EXPECT_EQ(part.at(9, 9), r.grid.at(19, 19));
        EXPECT_EQ(read_raster(file(name), Window{1000, 0, 1100, 100}).grid.columns, 0);
    }
}

TEST_F(Rasters, GdalReadsWhatWeWrite)
{
    if (!gdal()) GTEST_SKIP() << "no gdal-bin here";
    Raster r{hills(300, 200, -1500.5, 12000.5, 1), crs_from("EPSG:6670", "test")};
    r.grid.at(299, 0) = NAN;
    write_geotiff(file("a.tif"), r);
    const auto info = said_by("gdalinfo -stats " + file("a.tif").string());
    EXPECT_THAT(info, HasSubstr("Size is 300, 200"));
    EXPECT_THAT(info, HasSubstr("Japan Plane Rectangular CS II"));
    EXPECT_THAT(info, HasSubstr("ID[\"EPSG\",6670]"));
    EXPECT_THAT(info, HasSubstr("Origin = (-1501.000000000000000,12200.000000000000000)"));
    EXPECT_THAT(info, HasSubstr("Pixel Size = (1.000000000000000,-1.000000000000000)"));
    EXPECT_THAT(info, HasSubstr("NoData Value=-9999"));
    EXPECT_THAT(info, HasSubstr("AREA_OR_POINT=Area"));
    EXPECT_THAT(info, HasSubstr("COMPRESSION=DEFLATE"));
    EXPECT_THAT(info, HasSubstr("Block=300x"));
    const auto value = said_by("gdallocationinfo -valonly -geoloc " + file("a.tif").string() + " -1498.5 12010.5");
    EXPECT_NEAR(std::stod(value), r.grid.at(2, 10), 1e-4);
    // A system without a number is kept too.
    r.crs = crs_from("+proj=tmerc +lat_0=33 +lon_0=131.25 +k=0.9999 +x_0=100 +y_0=0 +ellps=GRS80 +units=m", "test");
    write_geotiff(file("b.tif"), r);
    EXPECT_THAT(said_by("gdalinfo " + file("b.tif").string()), HasSubstr("131.25"));
    EXPECT_TRUE(same_crs(read_raster(file("b.tif")).crs, r.crs)) << read_raster(file("b.tif")).crs << "\n" << r.crs;
}

TEST_F(Rasters, EveryKindThatGdalWrites)
{
    if (!gdal()) GTEST_SKIP() << "no gdal-bin here";
    Raster r{hills(300, 200, -1500.5, 12000.5, 1), crs_from("EPSG:6670", "test")};
    for (double& x : r.grid.values) x = std::round(x);
    r.grid.at(299, 0) = r.grid.at(0, 199) = NAN;
    write_geotiff(file("a.tif"), r);
    for (const char* options :
         {"-co TILED=YES", "-co COMPRESS=LZW", "-co COMPRESS=LZW -co PREDICTOR=2 -ot Int16", "-co COMPRESS=DEFLATE -co PREDICTOR=3",
          "-ot Float64 -co TILED=YES -co COMPRESS=DEFLATE -co PREDICTOR=3", "-ot Int16", "-ot Int32 -co BIGTIFF=YES", "-co ENDIANNESS=BIG",
          "-mo AREA_OR_POINT=Point", "-co COMPRESS=ZSTD", "-co COMPRESS=DEFLATE -co BLOCKYSIZE=200", "-of COG", "-co SPARSE_OK=TRUE"}) {
        ASSERT_THAT(said_by(fmt::format("gdal_translate -q {} {} {}", options, file("a.tif").string(), file("b.tif").string())),
                    ::testing::Not(HasSubstr("failed")))
            << options;
        const auto back = read_raster(file("b.tif"));
        EXPECT_TRUE(same(back.grid, r.grid)) << options;
        EXPECT_EQ(back.crs, r.crs) << options;
    }
    for (const char* epsg : {"EPSG:32652", "EPSG:2444", "EPSG:31287", "EPSG:6668", "EPSG:4326", "EPSG:2056"}) {
        said_by(fmt::format("gdal_translate -q -a_srs {} {} {}", epsg, file("a.tif").string(), file("b.tif").string()));
        EXPECT_EQ(read_raster(file("b.tif")).crs, crs_from(epsg, "test")) << epsg;
    }
}

TEST(CoordinateSystems, ANameIsNotGuessedAt)
{
    // PROJ finds a system whose name is like each of these.
    for (const char* text : {"Tokyo", "JGD2011", "WGS 84", "JGD2011 / Japan Plane Rectangular CS", "EPSG:4326 and more", "lambert", "", " ",
                             "WGS:84", "Tokyo:x", "somewhere +proj= 999", "+proj=utm zone 32", "+ellps=GRS80", "Tokyo +proj=utm +zone=32"})
        EXPECT_THROW(crs_from(text, "test"), BadInput) << text;
    const auto wkt = crs_from("EPSG:6670", "test");
    for (const std::string& text : {std::string("  EPSG:6670\r\n"), std::string("epsg:6670+6695"),
                                    std::string("urn:ogc:def:crs:EPSG::6670"), wkt + "\n", "\t" + esri_wkt(wkt)})
        EXPECT_EQ(crs_from(text, "test"), wkt) << text;
}

TEST(CoordinateSystems, AProjStringMayBeginWithAnyWord)
{
    const auto first = crs_from("+proj=utm +zone=32 +ellps=GRS80 +units=m", "test");
    EXPECT_EQ(crs_from("+ellps=GRS80 +proj=utm +zone=32 +units=m +type=crs", "test"), first);
}

TEST_F(Rasters, TheLibrariesSayNothingThemselves)
{
    Raster r{hills(37, 23, -1500.5, 12000.5, 1), crs_from("EPSG:6670", "test")};
    write_geotiff(file("a.tif"), r);
    auto bytes = read_text(file("a.tif"), 1 << 20);
    const char key[] = {1, 4, 0, 0, 1, 0}; // GTRasterTypeGeoKey, in its place, one number
    const auto at = bytes.find(std::string(key, sizeof key));
    ASSERT_NE(at, bytes.npos);
    bytes[at + 4] = 100; // of them
    write("b.tif", bytes);
    testing::internal::CaptureStderr();
    try {
        read_raster(file("b.tif"));
    } catch (const BadInput&) {
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(Rasters, WrongFilesAreRefusedWithTheirRemedy)
{
    write("word.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 four\n");
    EXPECT_THAT(refusal("word.asc"), HasSubstr("word.asc:7: row 2 from the north, column 2: expected a number, found \"four\""));
    write("short.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3\n");
    EXPECT_THAT(refusal("short.asc"), HasSubstr("the file ends in row 2 from the north, column 2"));
    write("long.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n5\n");
    EXPECT_THAT(refusal("long.asc"), HasSubstr("more than 2 x 2 numbers"));
    write("cell.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\n1 2\n3 4\n");
    EXPECT_THAT(refusal("cell.asc"), HasSubstr("has no cellsize"));
    write("text.asc", "Dear colleague\n");
    EXPECT_THAT(refusal("text.asc"), HasSubstr("begins like none of them"));
    EXPECT_THAT(refusal("absent.tif"), HasSubstr("cannot be opened"));
    write("broken.tif", std::string("II*\0\xff\xff\xff\xff", 8));
    EXPECT_THAT(refusal("broken.tif"), HasSubstr("cannot be read as a TIFF"));
    const auto bytes = geotiff_bytes({hills(60, 50, 0.5, 0.5, 1), ""});
    for (const std::size_t n : {bytes.size() / 2, bytes.size() - 40, std::size_t(2000)}) {
        write("cut.tif", bytes.substr(0, n));
        EXPECT_NE(refusal("cut.tif"), "taken") << n;
    }
}

} // namespace
} // namespace kuzure::io
