// Pictures of one run share camera and colours, show the soil where it is, in the colours promised, and come from snapshots.
// Beyond 400 lines: one test a promise of the pictures.
#include "io/map_picture.hpp"
#include "io/picture_series.hpp"
#include "io/snapshot.hpp"
#include "io/soil_color.hpp"
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numeric>
#include <omp.h>
#include <png.h>
#include <unistd.h>

using namespace kuzure;
using testing::HasSubstr;

namespace {

const SingleRank alone;

struct Image {
    int width = 0, height = 0;
    std::vector<png_byte> rgb;
    std::array<int, 3> at(int x, int y) const
    {
        const auto* p = &rgb[std::size_t(3 * (y * width + x))];
        return {p[0], p[1], p[2]};
    }
    bool operator==(const Image&) const = default;
};

Image decoded(const std::string& bytes)
{
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    EXPECT_TRUE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size())) << image.message;
    image.format = PNG_FORMAT_RGB;
    Image r{int(image.width), int(image.height), std::vector<png_byte>(PNG_IMAGE_SIZE(image))};
    EXPECT_TRUE(png_image_finish_read(&image, nullptr, r.rgb.data(), 0, nullptr)) << image.message;
    return r;
}
bool bluish(std::array<int, 3> c) { return c[2] > c[0] + 15; }
bool brownish(std::array<int, 3> c) { return c[0] > c[2] + 15; }
int count(const Image& im, const io::Stage& s, bool (*of)(std::array<int, 3>))
{
    int n = 0;
    for (int y = int(s.top); y < int(s.bottom); ++y)
        for (int x = int(s.left); x < int(s.right); ++x) n += of(im.at(x, y));
    return n;
}

const io::Quantity moved{"displacement", "m", io::Quantity::Map::Blues};
const auto every_view = {scene::View::Oblique, scene::View::Side, scene::View::Top, scene::View::Slice};

/// A cube of soil on a floor.
struct Cube {
    double d = 0.1;
    std::vector<Vector> soil, walls;
    std::vector<double> values;
    Cube()
    {
        for (int i = 0; i < 512; ++i) soil.push_back({(i % 8 + 0.5) * d, (i / 8 % 8 + 0.5) * d, (i / 64 + 0.5) * d});
        values.assign(soil.size(), 0.2);
        for (int a = -4; a < 12; ++a)
            for (int b = -4; b < 12; ++b) walls.push_back({(a + 0.5) * d, (b + 0.5) * d, -0.5 * d});
    }
    io::Stage stage(scene::View view) const
    {
        return io::stage_of(io::frame_of(io::reach_of(soil, values), io::reach_of(walls, {}).all, 3, d), view);
    }
    std::string draw(scene::View view, io::ColorRange range = {0, 1}) const
    {
        return io::Painter(stage(view), range, moved, "title", d, walls, false).draw({soil, values, "t = 0.50 s"});
    }
};

} // namespace

// ---- camera and range, without a picture -----------------------------------------------------------------------------------
TEST(Frame, HoldsAllSoilOfTheRunAndTheWallsAroundIt)
{
    const std::vector<Vector> start{{0, 0, 0}, {1, 1, 2}}, end{{-1, 0.5, 0}, {4, 1, 0.5}};
    const auto reach = io::joined(io::reach_of(start, {}), io::reach_of(end, {}));
    const io::Extent walls{{-1.5, -50, -0.2}, {5, 50, 0}};
    const auto frame = io::frame_of(reach, walls, 3, 0.1);
    for (const auto* state : {&start, &end})
        for (const Vector& p : *state) EXPECT_TRUE(frame.holds(p, -0.049)); // whole grains
    EXPECT_DOUBLE_EQ(frame.low.x, -1.55);                                   // to the end of a wall that ends near
    EXPECT_DOUBLE_EQ(frame.high.x, 5.05);
    EXPECT_DOUBLE_EQ(frame.low.z, -0.25);
    EXPECT_GT(frame.low.y, -2); // but not to that of a wall that goes far
    EXPECT_LT(frame.high.y, 3);
    EXPECT_EQ(frame, io::frame_of(io::joined(io::reach_of(end, {}), io::reach_of(start, {})), walls, 3, 0.1));
}

TEST(Frame, OneGrainThatFliesDoesNotShrinkTheRest)
{
    std::vector<Vector> soil(1000, Vector{0, 0, 0});
    for (int i = 0; i < 1000; ++i) soil[std::size_t(i)].x = 1e-3 * i;
    soil.push_back({100, 0, 0});
    soil.push_back({std::nan(""), 1e300, 0});
    const auto frame = io::frame_of(io::reach_of(soil, {}), {}, 3, 0.01);
    EXPECT_LT(frame.high.x, 1.5);
    EXPECT_GE(frame.high.x, 0.99);
    soil.resize(1000); // a long flow is no such grain
    EXPECT_GE(io::frame_of(io::reach_of(soil, {}), {}, 3, 0.01).high.x, 0.999);
    EXPECT_FALSE(io::frame_of({}, {}, 3, 0.01).empty());
}

TEST(Frame, EveryViewOfEveryShapeIsWithinItsPicture)
{
    for (const Vector size : {Vector{4, 4, 0.8}, {0.1, 0.1, 8}, {200, 1, 2}, {1, 200, 2}, {1e-3, 1e-3, 1e-3}})
        for (const auto view : every_view) {
            const io::Extent f{{-3, 2, 1}, Vector{-3, 2, 1} + size};
            const auto s = io::stage_of(f, view);
            EXPECT_LE(s.width, 1600);
            EXPECT_LE(s.height, 900);
            EXPECT_EQ(s.width % 2 + s.height % 2, 0);
            for (int k = 0; k < 8; ++k) {
                const Vector c{k & 1 ? f.high.x : f.low.x, k & 2 ? f.high.y : f.low.y, k & 4 ? f.high.z : f.low.z};
                EXPECT_GE(s.camera.x(c), 90);
                EXPECT_LE(s.camera.x(c), s.width - 200);
                EXPECT_GE(s.camera.y(c), 80);
                EXPECT_LE(s.camera.y(c), s.height - 75);
            }
        }
}

TEST(Ticks, AreRoundAndInside)
{
    for (const auto& [low, high] : {std::array{0.0, 1.0}, {-0.37, 12.4}, {1e6, 1.00001e6}, {-3e-5, 2e-5}, {0.0, 7e9}}) {
        const auto t = io::ticks(low, high, 7);
        ASSERT_GE(t.at.size(), 3u);
        ASSERT_LE(t.at.size(), 9u);
        const double lead = t.step / std::pow(10, std::floor(std::log10(t.step) + 1e-9));
        EXPECT_TRUE(std::fabs(lead - 1) < 1e-6 || std::fabs(lead - 2) < 1e-6 || std::fabs(lead - 5) < 1e-6) << lead;
        for (const double v : t.at) EXPECT_TRUE(v > low - 1e-5 * t.step && v < high + 1e-5 * t.step);
    }
    EXPECT_EQ(io::ticks(0, 1, 5).text(0.4), "0.4");
    EXPECT_EQ(io::ticks(0, 20000, 5).text(15000, 1e-3), "15");
    EXPECT_EQ(io::ticks(-1, 1, 5).text(-1e-17), "0.0");
    EXPECT_TRUE(io::ticks(1, 1, 5).at.empty());
    EXPECT_TRUE(io::ticks(0, std::nan(""), 5).at.empty());
}

TEST(ColorRange, IsThatOfTheRunAndOfMostOfItsSoil)
{
    const auto range = [](std::vector<double> v, bool has_signs = false, std::array<double, 2> given = {}) {
        return io::color_range(io::reach_of({}, v), has_signs, given);
    };
    // reach_of without places has none: values alone
    std::vector<double> even(1000);
    for (int i = 0; i < 1000; ++i) even[std::size_t(i)] = 0.97 * i / 999;
    const auto r = range(even);
    EXPECT_EQ(r.low, 0);
    EXPECT_NEAR(r.high, 1.0, 1e-12);
    EXPECT_FALSE(r.below || r.above);
    auto one_flies = even;
    one_flies[17] = 300, one_flies[18] = std::nan("");
    const auto f = range(one_flies);
    EXPECT_NEAR(f.high, 1.0, 1e-12);
    EXPECT_TRUE(f.above);
    EXPECT_FALSE(f.below);
    // the larger of two states decides, whichever comes first
    std::vector<double> still(1000, 0.0);
    const auto both = io::joined(io::reach_of({}, still), io::reach_of({}, even));
    EXPECT_EQ(io::color_range(both, false, {}), r);
    EXPECT_EQ(io::color_range(io::joined(io::reach_of({}, even), io::reach_of({}, still)), false, {}), r);
    const auto s = range({-3, -1, 0, 1}, true);
    EXPECT_EQ(s.low, -s.high);
    EXPECT_GE(s.high, 3);
    EXPECT_EQ(range(even, false, {0.25, 0.5}), (io::ColorRange{0.25, 0.5, true, true}));
    for (const auto& flat : {std::vector<double>{}, {0, 0}, {5, 5}, {-5e-12, -5e-12}, {std::nan("")}}) {
        const auto e = range(flat);
        EXPECT_LT(e.low, e.high);
    }
    EXPECT_GT(range({1800, 1850}).low, 1700); // a density does not begin at zero
}

// ---- words -----------------------------------------------------------------------------------------------------------------
TEST(CanvasText, KeepsInsideAndTakesAnything)
{
    io::Canvas c(40, 20);
    c.text(-30, 10, 14, "too long for this \xe5\xb4\xa9 \x01 \xff\xc3 canvas", {0, 0, 0});
    c.text(39, 500, 14, "outside", {0, 0, 0}, io::Anchor::Right);
    EXPECT_GT(io::Canvas::text_width(10, "mm"), io::Canvas::text_width(10, "ii"));
    EXPECT_EQ(io::Canvas::text_width(10, ""), 0);
    EXPECT_EQ(io::Canvas::letters_missing("plain, \u00e9t\u00e9"), "");
    EXPECT_EQ(io::Canvas::letters_missing("a\ue123b\ue123"), "\ue123"); // nobody's letter
    io::Canvas wide(300, 40);
    wide.text(0, 20, 20, "a title that goes on and on and on and on", {0, 0, 0}, io::Anchor::Left, 100);
    for (int y = 0; y < 40; ++y)
        for (int x = 106; x < 300; ++x) ASSERT_EQ(wide.at(x, y), (io::Rgb{255, 255, 255}));
}

TEST(CanvasText, JapaneseIsWrittenOrNamedAsMissing)
{
    const std::string title = "\u780c\u306e\u5d29\u58ca"; // the collapse of sand
    const auto missing = io::Canvas::letters_missing(title);
    EXPECT_TRUE(missing.empty() || missing.size() == title.size()) << missing;
    io::Canvas c(200, 40), boxes(200, 40);
    c.text(5, 20, 24, title, {0, 0, 0});
    boxes.text(5, 20, 24, "\u25a1\u25a1\u25a1\u25a1", {0, 0, 0});
    bool same = true;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 200; ++x) same &= c.at(x, y) == boxes.at(x, y);
    if (missing.empty()) EXPECT_FALSE(same);
}

// ---- pictures --------------------------------------------------------------------------------------------------------------
TEST(Picture, SoilIsBlueOnBrownGroundWithTitleAxesAndBar)
{
    const Cube c;
    for (const auto view : every_view) {
        const auto s = c.stage(view);
        const Image im = decoded(c.draw(view));
        ASSERT_EQ(im.width, s.width);
        ASSERT_EQ(im.height, s.height);
        EXPECT_GT(count(im, s, bluish), 8000) << int(view);
        EXPECT_GT(count(im, s, brownish), 3000) << int(view);
        EXPECT_EQ(im.at(2, im.height - 2), (std::array{255, 255, 255}));
        const auto dark = [&](int x0, int y0, int x1, int y1) {
            int n = 0;
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x) n += im.at(x, y)[0] < 100;
            return n;
        };
        EXPECT_GT(dark(40, 20, 200, 60), 50) << "a title";
        EXPECT_GT(dark(im.width - 240, 20, im.width - 30, 60), 50) << "the time";
        EXPECT_GT(dark(0, int(s.top), int(s.left), int(s.bottom)), 100) << "numbers on the left";
        if (view != scene::View::Oblique) EXPECT_GT(dark(int(s.left), int(s.bottom), int(s.right), im.height), 50) << "numbers below";
    }
}

TEST(Picture, TheFurtherTheDarkerAndNoNumberIsRed)
{
    Cube c;
    const auto s = c.stage(scene::View::Top);
    const auto brightness = [&] {
        const Image im = decoded(c.draw(scene::View::Top));
        long sum = 0;
        const int mx = int(0.5 * (s.left + s.right)), my = int(0.5 * (s.top + s.bottom));
        for (int y = my - 40; y < my + 40; ++y)
            for (int x = mx - 40; x < mx + 40; ++x) sum += im.at(x, y)[0];
        return double(sum);
    };
    const double before = brightness();
    c.values.assign(c.values.size(), 1.0);
    EXPECT_LT(brightness(), 0.5 * before);
    c.values.assign(c.values.size(), std::nan(""));
    EXPECT_GT(count(decoded(c.draw(scene::View::Top)), s, [](std::array<int, 3> p) { return p[0] > 60 && p[1] < p[0] / 3; }), 5000);
}

TEST(Picture, NeitherOrderNorThreadsMatter)
{
    Cube c;
    for (std::size_t i = 0; i < c.values.size(); ++i) c.values[i] = double(i % 37) / 37;
    const auto before = c.draw(scene::View::Oblique);
    std::vector<std::size_t> order(c.soil.size());
    std::iota(order.begin(), order.end(), 0);
    Cube other = c;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::size_t k = i * 45 % order.size() == 0 ? i : (i * 45) % order.size(); // 45 and 512 have no common factor
        other.soil[i] = c.soil[i == 0 ? 0 : k], other.values[i] = c.values[i == 0 ? 0 : k];
    }
    EXPECT_EQ(other.draw(scene::View::Oblique), before);
}

TEST(Picture, WhatAWallHidesShowsThroughStripes)
{
    Cube c;
    const auto s = c.stage(scene::View::Side);
    const int open = count(decoded(c.draw(scene::View::Side)), s, bluish);
    for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b) c.walls.push_back({(a + 0.5) * c.d, -3.5 * c.d, (b + 0.5) * c.d});
    const int behind = count(decoded(c.draw(scene::View::Side)), s, bluish);
    EXPECT_LT(behind, 0.85 * open);
    EXPECT_GT(behind, 0.4 * open);
}

TEST(Picture, NoSoilAndSoilOutsideAreSaid)
{
    Cube c;
    const auto s = c.stage(scene::View::Oblique);
    const io::Painter painter(s, {0, 1}, moved, "title", c.d, c.walls, false);
    const auto none = painter.draw({{}, {}, "t"});
    EXPECT_LT(count(decoded(none), s, bluish), 500); // rims of letters
    std::vector<Vector> far{{100, 0, 0}};
    std::vector<double> value{0};
    EXPECT_NE(painter.draw({far, value, "t"}), none); // "1 of 1 particles are outside"
    far = {{0.4, 0.4, 0.4}};
    io::Moment marked{far, value, "t", far[0]};
    const Image ring = decoded(painter.draw(marked));
    int red = 0;
    for (int y = 0; y < ring.height; ++y)
        for (int x = 0; x < ring.width; ++x) red += ring.at(x, y)[0] > 150 && ring.at(x, y)[1] < 90;
    EXPECT_GT(red, 60);
}

// ---- series ----------------------------------------------------------------------------------------------------------------
namespace {

class SeriesTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_picture_XXXXXX";
        ASSERT_TRUE(mkdtemp(name));
        dir = name;
        std::filesystem::create_directory(dir / "snapshots");
        Particles p;
        p.require(field::velocity, field::stress, field::density, field::origin);
        p.resize(Index(cube.soil.size()));
        for (Index i = 0; i < p.size(); ++i) {
            const Vector at = cube.soil[std::size_t(i)];
            p[field::id].set(i, std::int64_t(i));
            p[field::position].set(i, at), p[field::origin].set(i, at);
            p[field::density].set(i, 1800 + double(i % 7));
        }
        io::WallPoints walls;
        walls.position = cube.walls;
        walls.id.resize(walls.size()), walls.density.resize(walls.size());
        io::Snapshots snapshots(alone, dir / "snapshots");
        for (const double t : {0.0, 0.25, 0.5}) {
            for (Index i = 0; i < p.size(); ++i) {
                const Vector at = p[field::origin][i];
                p[field::position].set(i, at + Vector{2 * t * at.z, 0, -0.8 * t * at.z});
                p[field::velocity].set(i, Vector{at.z, 0, -at.x});
                p[field::stress].set(i, Stress{-1e3, -1e3, -1e3 * at.z});
            }
            snapshots.write(p, walls, {t, 0, 3, "a title", {}});
        }
        task.results = dir, task.spacing = cube.d, task.title = "a title";
    }
    void TearDown() override { std::filesystem::remove_all(dir); }
    std::string bytes(int number) { return io::read_text(io::picture_file(dir, number)); }

    Cube cube;
    io::Path dir;
    io::PictureTask task;
};

} // namespace

TEST_F(SeriesTest, OneCameraAndOneRangeFromTheFirstToTheLast)
{
    const auto drawn = io::draw_pictures(alone, task);
    ASSERT_EQ(drawn.files.size(), 3u);
    const Image first = decoded(bytes(0)), last = decoded(bytes(2));
    ASSERT_EQ(first.width, last.width);
    ASSERT_EQ(first.height, last.height);
    int differ = 0;
    for (int y = 70; y < first.height; ++y) { // below title and time
        for (int x = 0; x < 90; ++x) differ += first.at(x, y) != last.at(x, y);
        for (int x = first.width - 200; x < first.width; ++x) differ += first.at(x, y) != last.at(x, y);
    }
    for (int y = first.height - 60; y < first.height; ++y)
        for (int x = 0; x < first.width; ++x) differ += first.at(x, y) != last.at(x, y);
    EXPECT_EQ(differ, 0) << "axes and colour bar are those of the run";
    EXPECT_NE(first, last);
}

TEST_F(SeriesTest, TheBytesDoNotDependOnThreadsNorOnWhichAreAskedFor)
{
    const int had = omp_get_max_threads();
    omp_set_num_threads(1);
    io::draw_pictures(alone, task);
    const std::string before[] = {bytes(0), bytes(1), bytes(2)};
    omp_set_num_threads(3);
    io::draw_pictures(alone, task);
    omp_set_num_threads(had);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(bytes(k), before[k]);
    task.at = 0.3; // 0.25 is next
    task.file = [&](int) { return dir / "one.png"; };
    EXPECT_THAT(io::draw_pictures(alone, task).files, testing::ElementsAre(dir / "one.png"));
    EXPECT_EQ(io::read_text(dir / "one.png"), before[1]);
    task.at = HUGE_VAL;
    io::draw_pictures(alone, task);
    EXPECT_EQ(io::read_text(dir / "one.png"), before[2]);
    task.at = 0.6;
    EXPECT_THROW(io::draw_pictures(alone, task), BadInput);
}

TEST_F(SeriesTest, AnyFieldInAnyView)
{
    const io::H5Reader in(dir / "snapshots" / "state_000001.hdf");
    const auto names = io::soil_colors(in);
    for (const char* name :
         {"displacement", "speed", "plastic_strain", "pressure", "density", "stress", "stress_xz", "velocity_z", "id", "soil"})
        EXPECT_THAT(names, testing::Contains(name));
    EXPECT_THAT(names, testing::Not(testing::Contains("kind")));
    const auto value = [&](const char* name) { return io::SoilColor(in, name).read(in).values.at(100); };
    const double z = cube.soil[100].z, x = cube.soil[100].x;
    EXPECT_DOUBLE_EQ(value("speed"), std::hypot(z, x));
    EXPECT_DOUBLE_EQ(value("velocity_z"), -x);
    EXPECT_DOUBLE_EQ(value("pressure"), 1e3 * (2 + z) / 3);
    EXPECT_DOUBLE_EQ(value("stress_zz"), -1e3 * z);
    EXPECT_NEAR(value("stress"), 1e3 * (1 - z), 1e-9);
    EXPECT_DOUBLE_EQ(value("density"), 1800 + 100 % 7);
    EXPECT_EQ(io::SoilColor(in, "pressure").quantity().unit, "Pa");
    for (const auto view : every_view) {
        task.view = view, task.color = "velocity_x";
        EXPECT_EQ(io::draw_pictures(alone, task).files.size(), 3u);
    }
    task.color = "presure";
    try {
        io::draw_pictures(alone, task);
        FAIL();
    } catch (const BadInput& e) {
        EXPECT_THAT(e.what(), HasSubstr("did you mean \"pressure\""));
    }
}

TEST_F(SeriesTest, ADamagedSnapshotIsNamedOrLeftOut)
{
    const auto damaged = dir / "snapshots" / "state_000001.hdf";
    std::filesystem::resize_file(damaged, 1000);
    try {
        io::draw_pictures(alone, task);
        FAIL();
    } catch (const IoFailed& e) {
        EXPECT_THAT(e.what(), HasSubstr("state_000001.hdf"));
    }
    task.tolerant = true;
    const auto drawn = io::draw_pictures(alone, task);
    EXPECT_THAT(drawn.files, testing::ElementsAre(io::picture_file(dir, 0).path(), io::picture_file(dir, 2).path()));
    EXPECT_THAT(drawn.warnings, testing::ElementsAre(HasSubstr("state_000001.hdf")));
    task.results = dir / "nowhere";
    EXPECT_THROW(io::draw_pictures(alone, task), IoFailed);
}

TEST_F(SeriesTest, WallsComeFromTheirOwnFileOrFromTheFirstSnapshot)
{
    io::draw_pictures(alone, task);
    const auto before = bytes(2);
    std::filesystem::remove(dir / "snapshots" / "walls.hdf");
    io::draw_pictures(alone, task);
    EXPECT_EQ(bytes(2), before);
}

TEST(PictureNames, AreTheRunsOwnOrNot)
{
    EXPECT_EQ(io::picture_number(io::picture_file("a/b", 12).path()), 12);
    EXPECT_FALSE(io::picture_number("picture_speed_cut_000012.png"));
    EXPECT_FALSE(io::picture_number("picture_0000012.png"));
}

TEST(MapPictures, ShowTheHeightsOfTheGroundAsLines)
{
    io::MapPicture m{io::map_kinds[0], "slope", {0, 0, 10, 20, 16, std::vector<double>(320, 2.0)}};
    const auto lines = [&] { // pixels that are brown though the soil and the shade are not
        const Image im = decoded(io::map_png(m));
        int n = 0;
        for (int y = 75; y < im.height - 85; ++y)
            for (int x = 115; x < im.width - 215; ++x) {
                const auto c = im.at(x, y);
                n += c[0] < 190 && c[0] > c[1] + 12 && c[1] > c[2] + 8;
            }
        return n;
    };
    m.values.values.assign(320, std::nan("")), m.values.at(10, 8) = 1;
    EXPECT_EQ(lines(), 0) << "no ground, no lines";
    m.ground = [](double, double) { return 100.0; };
    EXPECT_EQ(lines(), 0) << "level ground";
    m.ground = [](double x, double) { return 100 + 0.5 * x; };
    const int slope = lines();
    EXPECT_GT(slope, 2000);
    m.ground = [](double x, double y) { return y < 80 ? std::nan("") : 100 + 0.5 * x; };
    const int half = lines();
    EXPECT_GT(half, 500) << "where there are heights";
    EXPECT_LT(half, 0.7 * slope) << "and nowhere else";
}

TEST(MapPictures, ShowNamedPointsOnTheMapAndJustBeside)
{
    io::MapPicture m{io::map_kinds[0], "houses", {1000, 500, 10, 20, 16, std::vector<double>(320, 2.0)}};
    const auto plain = io::map_png(m);
    m.points = {{"far away", 1600, 500}, {"below", 1100, 380}};
    EXPECT_EQ(io::map_png(m), plain) << "more than half of the map's size beyond it";
    m.points = {{"mill", 1100, 570}};
    const auto inside = io::map_png(m);
    EXPECT_NE(inside, plain);
    EXPECT_EQ(decoded(inside).width, decoded(plain).width) << "the map is as large as before";
    m.points = {{"school", 1250, 570}};
    EXPECT_GT(decoded(io::map_png(m)).width, decoded(plain).width - 1) << "a house that is missed";
    EXPECT_LT(decoded(io::map_png(m)).height, decoded(plain).height) << "the map shows more of x";
}
