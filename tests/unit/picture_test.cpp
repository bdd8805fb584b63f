// The picture shows the soil where it is, in the colours promised.
#include "io/canvas.hpp"
#include "io/picture.hpp"
#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

using namespace kuzure;

namespace {

const Alone alone;

struct Image {
    int width, height;
    std::vector<png_byte> rgb;
    std::array<int, 3> at(int x, int y) const
    {
        const auto* p = &rgb[std::size_t(3 * (y * width + x))];
        return {p[0], p[1], p[2]};
    }
};

Image load(const io::Path& file)
{
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    EXPECT_TRUE(png_image_begin_read_from_file(&image, file.c_str())) << image.message;
    image.format = PNG_FORMAT_RGB;
    Image r{int(image.width), int(image.height), std::vector<png_byte>(PNG_IMAGE_SIZE(image))};
    EXPECT_TRUE(png_image_finish_read(&image, nullptr, r.rgb.data(), 0, nullptr)) << image.message;
    return r;
}

class PictureTest : public testing::Test {
protected:
    void SetUp() override
    {
        char name[] = "/tmp/kuzure_picture_XXXXXX";
        ASSERT_TRUE(mkdtemp(name));
        dir = name;
        p.require(field::velocity, field::stress, field::origin);
        const int n = 8;
        p.resize(n * n * n);
        for (int i = 0; i < n * n * n; ++i) {
            const Vector x{(i % n + 0.5) * d, (i / n % n + 0.5) * d, (i / n / n + 0.5) * d};
            p[field::position].set(i, x);
            p[field::origin].set(i, x);
        }
        for (int a = -20; a < 28; ++a)
            for (int b = -20; b < 28; ++b) walls.position.push_back({(a + 0.5) * d, (b + 0.5) * d, -0.5 * d});
        walls.id.resize(walls.size());
        walls.density.resize(walls.size());
    }
    void TearDown() override { std::filesystem::remove_all(dir); }
    Image draw(scene::View view, scene::Color color, int dimensions = 3, std::array<double, 2> range = {})
    {
        const auto box = io::soil_extent(alone, p);
        io::write_picture(alone, dir / "p.png", p, walls,
                          {{view, color, range}, dimensions, box.low, box.high, d, "title", 0.5, middle_y, 800, 450});
        return load(dir / "p.png");
    }
    const double d = 0.1, middle_y = 0.4;
    io::Path dir;
    Particles p;
    io::WallPoints walls;
};

} // namespace

TEST_F(PictureTest, SoilIsBlueOnBrownGround)
{
    for (const auto view : {scene::View::Oblique, scene::View::Side, scene::View::Top, scene::View::Cut}) {
        const Image im = draw(view, scene::Color::Displacement);
        ASSERT_EQ(im.width, 800);
        ASSERT_EQ(im.height, 450);
        int blue = 0, brown = 0;
        for (int y = 60; y < 380; ++y)
            for (int x = 0; x < 560; ++x) {
                const auto [r, g, b] = im.at(x, y);
                blue += b > r + 15;
                brown += r > b + 15;
            }
        EXPECT_GT(blue, 5000) << int(view);
        EXPECT_GT(brown, 500) << int(view);
        EXPECT_EQ(im.at(2, 440), (std::array{255, 255, 255}));
    }
}

TEST_F(PictureTest, TheFurtherTheDarker)
{
    const auto brightness = [&] {
        const Image im = draw(scene::View::Top, scene::Color::Displacement);
        long sum = 0, n = 0;
        for (int y = 200; y < 240; ++y)
            for (int x = 260; x < 300; ++x, ++n) sum += im.at(x, y)[0];
        return double(sum) / double(n);
    };
    const double before = brightness();
    for (Index i = 0; i < p.size(); ++i) p[field::origin].set(i, p[field::position][i] - Vector{0.5, 0, 0});
    EXPECT_LT(brightness(), 0.5 * before);
}

TEST_F(PictureTest, EveryColourAndNoSoilAtAll)
{
    for (const auto color : {scene::Color::Displacement, scene::Color::Speed, scene::Color::PlasticStrain, scene::Color::Pressure}) {
        p[field::stress].set(3, Stress{-1e3, -1e3, -1e3});
        p[field::velocity].set(3, Vector{std::nan(""), 0, 0});
        draw(scene::View::Oblique, color);
        draw(scene::View::Oblique, color, 2);
    }
    for (Index i = 0; i < p.size(); ++i) p[field::velocity].set(i, Vector{1e-309 * double(i), 0, 0});
    draw(scene::View::Oblique, scene::Color::Speed); // so slow that 1/speed is infinite
    p.resize(0);
    draw(scene::View::Oblique, scene::Color::Speed);
}

TEST_F(PictureTest, TextKeepsInsideTheCanvas)
{
    io::Canvas c(40, 20);
    c.text(-30, 10, 14, "too long for this \xe5\xb4\xa9 \x01 canvas", {0, 0, 0});
    c.text(39, 500, 14, "outside", {0, 0, 0}, io::Anchor::Right);
    EXPECT_GT(io::Canvas::text_width(10, "mm"), io::Canvas::text_width(10, "ii"));
    EXPECT_EQ(io::Canvas::text_width(10, ""), 0);
    EXPECT_EQ(c.png().substr(1, 3), "PNG");
}

TEST_F(PictureTest, AFailureIsAnIoFailure)
{
    const auto box = io::soil_extent(alone, p);
    EXPECT_THROW(io::write_picture(alone, dir / "none" / "p.png", p, walls, {{}, 3, box.low, box.high, d, "", 0, {}}), IoFailed);
}
