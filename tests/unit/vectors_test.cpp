// Outlines and points: what we write is read by us and by GDAL's tools; what is read keeps holes, names and thicknesses.
#include "io/ground/vectors.hpp"
#include "solver/scene/ring.hpp"
#include "tests/unit/map_files.hpp"
#include <cmath>

namespace kuzure::io {
namespace {

using ::testing::HasSubstr;

class Vectors : public MapFiles {
protected:
    const scene::Ring outer{{100, 200}, {140, 200}, {140, 240}, {100, 240}}, hole{{110, 210}, {120, 210}, {120, 220}, {110, 220}},
        island{{200, 200}, {210, 200}, {205, 210}};
    MapLayer layer() const
    {
        return {MapLayer::Polygons,
                {"thickness", "name"},
                {{{outer, hole}, {4.5, std::string("崩壊 1")}}, {{island}, {2.0, std::string("2")}}},
                crs_from("EPSG:6670", "test")};
    }
};

TEST(Rings, InsideIsWhatAnOddNumberEncloses)
{
    const std::vector<scene::Ring> rings{{{0, 0}, {10, 0}, {10, 10}, {0, 10}}, {{2, 2}, {4, 2}, {4, 4}, {2, 4}}};
    EXPECT_TRUE(scene::encloses(rings, 1, 1));
    EXPECT_FALSE(scene::encloses(rings, 3, 3));
    EXPECT_FALSE(scene::encloses(rings, 11, 3));
    EXPECT_EQ(area(rings), 96);
    // At a distance of a million metres, as on a map.
    auto far = rings;
    for (auto& ring : far)
        for (auto& p : ring) p[0] += 1e6, p[1] += 4e6;
    EXPECT_NEAR(area(far), 96, 1e-9);
}

TEST_F(Vectors, AShapefileIsReadAsItWasWritten)
{
    write_shapefile(file("a.shp"), layer());
    const auto read = read_outlines(file("a.shp"));
    EXPECT_EQ(read.crs, crs_from("EPSG:6670", "test"));
    ASSERT_EQ(read.features.size(), 2u);
    EXPECT_EQ(read.features[0].rings.size(), 2u);
    EXPECT_EQ(area(read.features[0].rings), 1500);
    EXPECT_EQ(read.features[0].thickness, 4.5);
    EXPECT_EQ(area(read.features[1].rings), 50);
    EXPECT_FALSE(scene::encloses(read.features[0].rings, 115, 215));
    // The same bytes again, and no date in them.
    write_shapefile(file("b.shp"), layer());
    for (const char* ending : {".shp", ".shx", ".dbf", ".prj", ".cpg"})
        EXPECT_EQ(bytes(file(std::string("a") + ending)), bytes(file(std::string("b") + ending))) << ending;
}

TEST_F(Vectors, GdalReadsWhatWeWrite)
{
    if (!gdal()) GTEST_SKIP() << "no gdal-bin here";
    write_shapefile(file("a.shp"), layer());
    const auto said = said_by("ogrinfo -al " + file("a.shp").string());
    EXPECT_THAT(said, HasSubstr("Geometry: Polygon"));
    EXPECT_THAT(said, HasSubstr("Feature Count: 2"));
    EXPECT_THAT(said, HasSubstr("ID[\"EPSG\",6670]"));
    EXPECT_THAT(said, HasSubstr("thickness (Real) = 4.5"));
    EXPECT_THAT(said, HasSubstr("name (String) = 崩壊 1"));
    EXPECT_THAT(said, HasSubstr("(110 210"));
    MapLayer lines{MapLayer::Lines, {"limit"}, {{{{{0, 0}, {1, 1}, {2, 0}}}, {0.5}}}, crs_from("EPSG:32652", "test")};
    write_shapefile(file("l.shp"), lines);
    EXPECT_THAT(said_by("ogrinfo -al " + file("l.shp").string()), HasSubstr("LINESTRING (0 0,1 1,2 0)"));
    MapLayer points{MapLayer::Points, {"name"}, {{{{{3, 4}}}, {std::string("house")}}}, ""};
    write_shapefile(file("p.shp"), points);
    EXPECT_THAT(said_by("ogrinfo -al " + file("p.shp").string()), HasSubstr("POINT (3 4)"));
}

TEST_F(Vectors, WhatGdalWritesIsRead)
{
    if (!gdal()) GTEST_SKIP() << "no gdal-bin here";
    write_shapefile(file("a.shp"), layer());
    ASSERT_THAT(said_by(fmt::format("ogr2ogr -f GeoJSON {} {}", file("a.geojson").string(), file("a.shp").string())),
                ::testing::Not(HasSubstr("failed")));
    const auto json = read_outlines(file("a.geojson"));
    EXPECT_EQ(json.crs, crs_from("EPSG:6670", "test")); // by its member crs, as older GDAL writes it
    EXPECT_EQ(json.features[0].thickness, 4.5);
    EXPECT_EQ(area(json.features[0].rings), 1500);
    said_by(fmt::format("ogr2ogr -f GeoJSON -lco RFC7946=YES {} {}", file("w.geojson").string(), file("a.shp").string()));
    const auto world = read_outlines(file("w.geojson"));
    EXPECT_TRUE(is_geographic(world.crs));
    const Transform way(world.crs, json.crs, "test");
    const auto p = way(world.features[1].rings[0][0][0], world.features[1].rings[0][0][1]);
    EXPECT_NEAR(std::hypot(p[0] - json.features[1].rings[0][0][0], p[1] - json.features[1].rings[0][0][1]), 0, 0.02);
    said_by(fmt::format("ogr2ogr -t_srs EPSG:32652 {} {}", file("u.shp").string(), file("a.shp").string()));
    EXPECT_EQ(read_outlines(file("u.shp")).crs, crs_from("EPSG:32652", "test"));
}

TEST_F(Vectors, PointsHaveNames)
{
    MapLayer points{MapLayer::Points, {"name"}, {{{{{3, 4}}}, {std::string("house")}}, {{{{5, 6}}}, {std::string()}}}, ""};
    write_shapefile(file("p.shp"), points);
    const auto read = read_points(file("p.shp"));
    ASSERT_EQ(read.points.size(), 2u);
    EXPECT_EQ(read.points[0].name, "house");
    EXPECT_EQ(read.points[1].name, "2");
    EXPECT_EQ(read.points[1].y, 6);
    write("p.geojson", R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"Name":"家"},)"
                       R"("geometry":{"type":"Point","coordinates":[131,33,5]}}]})");
    EXPECT_EQ(read_points(file("p.geojson")).points[0].name, "家");
    EXPECT_EQ(read_points(file("p.geojson")).points[0].x, 131);
    EXPECT_THROW(read_outlines(file("p.geojson")), BadInput);
    EXPECT_THROW(read_outlines(file("p.shp")), BadInput);
}

TEST_F(Vectors, DamagedFilesAreRefused)
{
    write_shapefile(file("a.shp"), layer());
    std::filesystem::remove(file("a.prj"));
    const auto whole = bytes(file("a.shp"));
    for (std::size_t n = 0; n < whole.size(); n += 7) {
        write("a.shp", whole.substr(0, n));
        EXPECT_THROW(read_outlines(file("a.shp")), BadInput) << n;
    }
    for (std::size_t k = 100; k < whole.size(); ++k) { // any value: refused or read, never worse
        auto broken = whole;
        broken[k] = char(broken[k] ^ 0x85);
        write("a.shp", broken);
        try {
            read_outlines(file("a.shp"));
        } catch (const BadInput&) {
        }
    }
}

TEST(Systems, AxesAreEastAndNorthWhateverTheSystemSays)
{
    if (!has_terrain()) GTEST_SKIP() << "built without maps";
    const auto plane = crs_from("EPSG:6670", "test"), degrees = crs_from("EPSG:6668", "test");
    EXPECT_TRUE(is_geographic(degrees));
    EXPECT_FALSE(is_geographic(plane));
    EXPECT_EQ(metres_per_unit(plane), 1);
    const Transform way(degrees, plane, "test");
    const auto p = way(130.984, 32.886);
    EXPECT_NEAR(p[0], -1496.7, 20); // Y of zone II, to the east
    EXPECT_NEAR(p[1], -12641.6, 20);
    const auto back = way.back(p[0], p[1]);
    EXPECT_NEAR(back[0], 130.984, 1e-9);
    EXPECT_NEAR(back[1], 32.886, 1e-9);
    EXPECT_EQ(utm_zone(130.98, 32.9), "EPSG:32652");
    EXPECT_EQ(utm_zone(-70, -33), "EPSG:32719");
    EXPECT_TRUE(same_crs(plane, crs_from(esri_wkt(plane), "test")));
    EXPECT_FALSE(same_crs(plane, crs_from("EPSG:6671", "test")));
    EXPECT_FALSE(same_crs(plane, crs_from("EPSG:2444", "test"))); // the same zone of JGD2000
    for (const char* wrong : {"", "EPSG:", "EPSG:6695", "EPSG:4978", "nothing", "GEOGCS["})
        EXPECT_THROW(crs_from(wrong, "test"), BadInput) << wrong;
}

} // namespace
} // namespace kuzure::io
