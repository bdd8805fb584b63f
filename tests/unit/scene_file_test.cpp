// Every rule of the reader is broken once, and what is written reads back to the same bits.
// Beyond 400 lines: one test a rule of the reader.
#include "io/scene_file.hpp"
#include "io/scene_keys.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/fill.hpp"
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <regex>
#include <set>
#include <sstream>

using namespace kuzure;
namespace fs = std::filesystem;
using ::testing::HasSubstr;

namespace {

const fs::path source = KUZURE_SOURCE_DIR;

const std::string least = R"(title = "least"
dimensions = 3
[space]
spacing = 0.1
[time]
end = 1
[soil.sand]
density = 1850
young = 1.8e6
poisson = 0.3
friction_angle = 25
[[body]]
soil = "sand"
box = { low = [0, 0, 0], high = [1, 1, 1] }
)";

const std::string full = R"(title = "all \"keys\" \\ at once"
dimensions = 3
[space]
spacing = 0.1
h = 1.25
low = [-2.0, -1.0, -3.0]
high = [5.0, 4.0, 9.0]
periodic = ["y"]
[time]
end = 0.7
step = 1e-4
[soil.sand]
density = 1850.3
young = 1.7e6
poisson = 0.31
friction_angle = 25.3
dilation_angle = 1.1
cone = "plane strain, no dilation"
[soil.clay]
density = 1600
young = 1e6
poisson = 0.4
cohesion = 4.7e3
friction_angle = 7.7
tension_cutoff = 123.456
cone = "extension"
[soil.a]
density = 1600
young = 1e6
poisson = 0.4
cohesion = 4.7e3
[[body]]
soil = "sand"
box = { low = [0, 0, 0], high = [1, 1, 1] }
velocity = [0.1, -0.2, 0.3]
stress = "at rest"
[[body]]
soil = "clay"
cylinder = { base = [3, 1.5, 0.0], radius = 0.7, height = 0.8 }
[[body]]
soil = "a"
sphere = { center = [0.5, 0.5, 3.0], radius = 0.7 }
[[body]]
soil = "sand"
polygon = { points = [[0, 5], [1, 5], [0.3, 6.1]], y = [0.0, 1.0] }
[[wall]]
box = { low = [-1, -1, -0.4], high = [4, 4, 0] }
surface = { friction_angle = 20.1 }
[[wall]]
polygon = { points = [[4.1, 0], [4.9, 0], [4.5, 1]], y = [0, 1] }
surface = "smooth"
[effects]
gravity = [0, 0, -9.81]
viscosity = { alpha = 0.1 }
artificial_stress = { epsilon = 0.4 }
damping = { ratio = 0.02, until = 0.5 }
[accuracy]
kernel = "wendland c4"
cfl = 0.3
precision = "mixed"
skin = 0.07
[output]
directory = "results/x"
every = 0.05
fields = ["stress", "velocity"]
history = 0.001
grain = 0.08
checkpoint_minutes = 12
picture = { color = "speed" }
)";

std::string text_of(const fs::path& path)
{
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string refusal(const std::string& text, std::vector<std::string> sets = {})
{
    try {
        io::parse_scene(text, "s.toml", sets);
    } catch (const BadInput& e) {
        return e.what();
    }
    return "accepted";
}

Scene parsed(const std::string& text, std::vector<std::string> sets = {}) { return io::parse_scene(text, "s.toml", sets); }

class BadScene : public ::testing::TestWithParam<fs::path> {};
std::vector<fs::path> corpus(const char* folder)
{
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(source / "tests/scenes" / folder))
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

/// What of the first line stands behind a marker.
std::string first_line(const std::string& text, const std::string& marker)
{
    EXPECT_TRUE(text.starts_with(marker)) << text.substr(0, 60);
    return text.substr(marker.size(), text.find('\n') - marker.size());
}
class DoubtfulScene : public BadScene {};

} // namespace

TEST_P(BadScene, IsRefusedWithItsMessage)
{
    const auto expected = first_line(text_of(GetParam()), "# expect: ");
    try {
        io::read_scene(GetParam());
        FAIL() << "accepted";
    } catch (const BadInput& e) {
        const std::string message = e.what();
        EXPECT_TRUE(std::regex_search(message, std::regex(expected))) << "expected: " << expected << "\nfound:    " << message;
        EXPECT_TRUE(message.starts_with(GetParam().string() + ":")) << message;
        const auto lines = std::count(message.begin(), message.end(), '\n') + 1;
        // Where nothing stands, or a whole soil is lost, more than one key is missing.
        const std::set<std::string> wide{"empty", "only_a_comment", "soil_without_name"};
        if (!wide.contains(GetParam().stem().string()))
            EXPECT_LE(lines, GetParam().stem() == "several" ? 2 : 3) << "one mistake, many complaints:\n" << message;
    }
}
INSTANTIATE_TEST_SUITE_P(Corpus, BadScene, ::testing::ValuesIn(corpus("bad")), [](const auto& info) { return info.param.stem().string(); });

TEST_P(DoubtfulScene, IsAcceptedWithItsWarning)
{
    const auto expected = first_line(text_of(GetParam()), "# warns: ");
    std::string all;
    for (const auto& issue : scene::check(io::read_scene(GetParam()))) {
        EXPECT_EQ(issue.severity, scene::Severity::Warning);
        all += issue.key + ": " + issue.text + "\n";
    }
    EXPECT_TRUE(std::regex_search(all, std::regex(expected))) << "expected: " << expected << "\nfound:    " << all;
}
INSTANTIATE_TEST_SUITE_P(Corpus, DoubtfulScene, ::testing::ValuesIn(corpus("doubtful")),
                         [](const auto& info) { return info.param.stem().string(); });

TEST(SceneFile, CorpusIsLarge)
{
    EXPECT_GE(corpus("bad").size(), 280u);
    EXPECT_GE(corpus("doubtful").size(), 25u);
}

TEST(SceneFile, EveryJobIsReadWithoutAWarning)
{
    for (const auto& entry : fs::directory_iterator(source / "jobs/scenes"))
        if (entry.path().extension() == ".toml") {
            const auto scene = io::read_scene(entry.path());
            // The paper's larger cubes are as soft as its small one: that they are warned of is right.
            // That a tall column runs too far is what the scene of one is there to show.
            const bool tall = entry.path().stem() == "column";
            const bool large = entry.path().stem() == "hirata_104" || entry.path().stem() == "hirata_208";
            for (const auto& issue : scene::check(scene))
                if ((!large || (issue.key != "base_strain" && issue.key != "mach")) && !(tall && issue.key == "slenderness"))
                    ADD_FAILURE() << entry.path() << ": " << issue.key << ": " << issue.text;
        }
}

// What kuzure itself recommends it must not warn of: every preset, in the kernel and step that it sets, in 3-D and 2-D.
TEST(SceneFile, NoPresetIsWarnedOfItsStep)
{
    std::string text;
    std::istringstream lines(text_of(source / "jobs/scenes/quickstart.toml"));
    for (std::string line; std::getline(lines, line);)
        if (!line.starts_with("step ") && !line.starts_with("kernel ")) text += line + "\n";
    for (const auto& preset : io::presets())
        for (const char* dimensions : {"dimensions=3", "dimensions=2"}) {
            const std::vector<std::string> sets{"accuracy.preset=" + preset.name, dimensions};
            const auto scene = io::parse_scene(text, "quickstart", sets);
            ASSERT_FALSE(scene.time.step.has_value());
            for (const auto& issue : scene::check(scene)) EXPECT_NE(issue.key, "accuracy.cfl") << preset.name << ": " << issue.text;
        }
}

TEST(SceneFile, DefaultsOfTheTableAreThoseOfTheStructs)
{
    const auto scene = parsed(least);
    Scene plain;
    plain.space.spacing = 0.1, plain.time.end = 1;
    EXPECT_EQ(scene.space, plain.space);
    EXPECT_EQ(scene.time, plain.time);
    EXPECT_EQ(scene.accuracy, plain.accuracy);
    EXPECT_EQ(scene.output, plain.output);
    EXPECT_EQ(scene.effects, plain.effects);
    EXPECT_TRUE(scene.walls.empty());
    scene::Soil sand;
    sand.name = "sand", sand.density = 1850, sand.young = 1.8e6, sand.poisson = 0.3;
    sand.friction_angle = 25 * (std::numbers::pi / 180);
    ASSERT_EQ(scene.soils.size(), 1u);
    EXPECT_EQ(scene.soils[0], sand);
    ASSERT_EQ(scene.bodies.size(), 1u);
    EXPECT_EQ(scene.bodies[0], (scene::Body{0, scene::Box{{0, 0, 0}, {1, 1, 1}}}));
    const auto table = parsed(least + "[effects]\nartificial_stress = {}\n[output]\npicture = {}\n");
    EXPECT_EQ(table.effects.artificial_stress, scene::ArtificialStress{});
    EXPECT_EQ(table.output.picture, scene::Picture{});
    const auto wall = parsed(least + "[[wall]]\nsphere = { center = [9, 9, 9], radius = 1 }\n");
    EXPECT_EQ(wall.walls[0], (scene::Wall{scene::Sphere{{9, 9, 9}, 1}}));
}

TEST(SceneFile, EveryKeyArrives)
{
    const auto s = parsed(full);
    EXPECT_EQ(s.title, "all \"keys\" \\ at once");
    EXPECT_EQ(s.space.h, 1.25);
    EXPECT_EQ(s.space.high, (Vector{5, 4, 9}));
    EXPECT_EQ(s.space.periodic, (std::array<bool, 3>{false, true, false}));
    EXPECT_EQ(s.time.step, 1e-4);
    ASSERT_EQ(s.soils.size(), 3u);
    EXPECT_EQ(s.soils[0].name, "sand");
    EXPECT_EQ(s.soils[1].name, "clay");
    EXPECT_EQ(s.soils[2].name, "a");
    EXPECT_EQ(s.soils[0].cone, scene::Cone::PlaneStrainNoDilation);
    EXPECT_EQ(s.soils[1].tension_cutoff, 123.456);
    EXPECT_EQ(s.bodies[1].soil, 1);
    EXPECT_EQ(s.bodies[2].soil, 2);
    EXPECT_EQ(s.bodies[0].stress, scene::InitialStress::AtRest);
    EXPECT_EQ(s.bodies[0].velocity, (Vector{0.1, -0.2, 0.3}));
    EXPECT_EQ(std::get<scene::Cylinder>(s.bodies[1].shape), (scene::Cylinder{{3, 1.5, 0}, 0.7, 0.8}));
    EXPECT_EQ(std::get<scene::Polygon>(s.bodies[3].shape).points.at(2), (std::array<double, 2>{0.3, 6.1}));
    EXPECT_EQ(s.walls[0].surface, scene::Surface::Coulomb);
    EXPECT_DOUBLE_EQ(s.walls[0].friction_angle, 20.1 * std::numbers::pi / 180);
    EXPECT_EQ(s.walls[1].surface, scene::Surface::Smooth);
    EXPECT_EQ(s.effects.viscosity, (scene::Viscosity{0.1, 0}));
    EXPECT_EQ(s.effects.artificial_stress, (scene::ArtificialStress{0.4, 2.55}));
    EXPECT_EQ(s.effects.damping, (scene::Damping{0.02, 0.5}));
    EXPECT_EQ(s.accuracy.kernel, scene::Kernel::WendlandC4);
    EXPECT_EQ(s.accuracy.precision, scene::Precision::Mixed);
    EXPECT_EQ(s.output.fields, (std::vector<std::string>{"stress", "velocity"}));
    EXPECT_EQ(s.output.grain, 0.08);
    EXPECT_EQ(s.output.picture, (scene::Picture{scene::View::Oblique, scene::Color::Speed}));
}

TEST(SceneFile, WhatIsWrittenReadsBackToTheSameScene)
{
    std::vector<std::string> texts{least, full, least + "[effects]\nartificial_stress = \"auto\"\n"};
    for (const auto& entry : fs::directory_iterator(source / "jobs/scenes")) texts.push_back(text_of(entry.path()));
    for (const auto& text : texts) {
        const auto scene = parsed(text);
        const auto written = io::write_scene(scene);
        const auto again = parsed(written);
        EXPECT_TRUE(again == scene) << written;
        EXPECT_EQ(io::write_scene(again), written);
        EXPECT_EQ(io::scene_hash(again), io::scene_hash(scene));
    }
}

TEST(SceneFile, AnglesSurviveBitForBit)
{
    for (int k = 0; k < 2000; ++k) {
        const double angle = 0.01 + k * 0.04497;
        const auto scene = parsed(least, {fmt::format("soil.sand.friction_angle={}", angle)});
        const auto again = parsed(io::write_scene(scene));
        ASSERT_EQ(again.soils[0].friction_angle, scene.soils[0].friction_angle) << angle;
    }
    EXPECT_THAT(io::write_scene(parsed(least)), HasSubstr("friction_angle = 25.0 "));
}

TEST(SceneFile, SetsOverride)
{
    const auto s = parsed(least, {"space.spacing=0.05", "soil.sand.cohesion = 100", "accuracy.kernel=wendland c2", "title=42",
                                  "body.0.velocity=[1, 2, 3]", "effects.viscosity.alpha=0.3", "output.picture={view=\"top\"}",
                                  "accuracy.cfl=0.3", "accuracy.cfl=0.1"});
    EXPECT_EQ(s.space.spacing, 0.05);
    EXPECT_EQ(s.soils[0].cohesion, 100);
    EXPECT_EQ(s.accuracy.kernel, scene::Kernel::WendlandC2);
    EXPECT_EQ(s.title, "42");
    EXPECT_EQ(s.bodies[0].velocity, (Vector{1, 2, 3}));
    EXPECT_EQ(s.effects.viscosity, (scene::Viscosity{0.3, 0}));
    EXPECT_EQ(s.output.picture->view, scene::View::Top);
    EXPECT_EQ(s.accuracy.cfl, 0.1);
    EXPECT_EQ(parsed(full, {"wall.1.surface.friction_angle=10"}).walls[1].surface, scene::Surface::Coulomb);
    EXPECT_EQ(parsed(full, {"effects.artificial_stress=auto"}).effects.artificial_stress_decision, scene::Decision::Auto);
}

TEST(SceneFile, WrongSetsAreRefused)
{
    EXPECT_THAT(refusal(least, {"space.spaceing=0.05"}), HasSubstr("--set space.spaceing=0.05: space.spaceing: expected a known key"));
    EXPECT_THAT(refusal(least, {"space.spacing=-1"}), HasSubstr("--set space.spacing=-1: space.spacing: expected a number in m"));
    EXPECT_THAT(refusal(least, {"space.spacing=fine"}), HasSubstr("--set space.spacing=fine: space.spacing: expected a number in m"));
    EXPECT_THAT(refusal(least, {"space.spacing"}), HasSubstr("expected key.path=value"));
    EXPECT_THAT(refusal(least, {"space.spacing="}), HasSubstr("expected key.path=value"));
    EXPECT_THAT(refusal(least, {"=3"}), HasSubstr("expected key.path=value"));
    EXPECT_THAT(refusal(least, {"space..h=3"}), HasSubstr("expected key.path=value"));
    EXPECT_THAT(refusal(least, {"body.1.velocity=[0,0,0]"}), HasSubstr("expected a number from 0 to 0 after body"));
    EXPECT_THAT(refusal(least, {"title.x=3"}), HasSubstr("expected a key inside a table"));
    EXPECT_THAT(refusal(least, {"time.end=1\nstep=2"}), HasSubstr("time.end: expected a number"));
    EXPECT_THAT(refusal(least, {"title=\xff"}), HasSubstr("expected UTF-8"));
}

TEST(SceneFile, BytesThatAreNoTextAreRefused)
{
    EXPECT_THAT(refusal(least + "# \xff\n"), HasSubstr("s.toml:15: expected UTF-8, found the byte 0xff"));
    EXPECT_THAT(refusal(least + "# \xC0\x80\n"), HasSubstr("expected UTF-8"));
    EXPECT_THAT(refusal(least + "# \xED\xA0\x80\n"), HasSubstr("expected UTF-8"));
    EXPECT_THAT(refusal(least + "# \xE2\x82"), HasSubstr("expected UTF-8"));
    EXPECT_THAT(refusal("\xEF\xB9\xBF:" + least), HasSubstr("s.toml:1: expected text, found the character U+FE7F"));
    EXPECT_THAT(refusal(least + "\n\xEF\xBB\xBD"), HasSubstr("s.toml:16: expected text, found the character U+FEFD"));
    EXPECT_THAT(refusal(least + std::string(1 << 20, ' ')), HasSubstr("at most 1 MiB"));
    EXPECT_THAT(refusal(std::string("title = \"a\0b\"\n", 15) + least), HasSubstr("expected TOML"));
    EXPECT_THAT(refusal(""), HasSubstr("title: expected a string, found nothing"));
    EXPECT_THAT(refusal(std::string(100000, '[')), HasSubstr("expected TOML"));
    EXPECT_EQ(parsed("\xEF\xBB\xBF" + least).title, "least");
    EXPECT_EQ(parsed("# 砂の崩壊\n" + least, {"title=崩れ"}).title, "崩れ");
}

TEST(SceneFile, FilesThatCannotBeReadAreRefused)
{
    const auto message = [](const fs::path& path) {
        try {
            io::read_scene(path);
        } catch (const BadInput& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    EXPECT_THAT(message("no/such.toml"), HasSubstr("no/such.toml: expected a scene file, found No such file"));
    EXPECT_THAT(message("/"), HasSubstr("found a directory"));
}

TEST(SceneFile, AtMostTwentyProblemsAreShown)
{
    std::string text = least;
    for (int k = 0; k < 30; ++k) text += fmt::format("unknown_{} = 1\n", k);
    const auto message = refusal(text);
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 20);
    EXPECT_THAT(message, HasSubstr("and 10 more"));
}

TEST(SceneFile, ThousandsOfBodiesInOnePlaceAreRefusedAtOnce)
{
    // All pairs of them overlap: once that took all memory, and no end.
    std::string text = least;
    while (text.size() < 400000) text += "[[body]]\nsoil=\"sand\"\nbox={low=[0,0,0],high=[1,1,1]}\n";
    const auto message = refusal(text);
    EXPECT_THAT(message, HasSubstr("found an overlap of body.1 with body.0"));
    EXPECT_LE(std::count(message.begin(), message.end(), '\n'), 20);
}

TEST(SceneFile, AnUnstableStepCanBeForced)
{
    const std::vector<std::string> sets{"time.step=0.01"};
    EXPECT_THROW(io::parse_scene(least, "s.toml", sets), BadInput);
    EXPECT_EQ(io::parse_scene(least, "s.toml", sets, scene::StepLimit::Force).time.step, 0.01);
}

TEST(SceneFile, HashTellsPhysicsFromBookkeeping)
{
    const auto hash = [](std::vector<std::string> sets) { return io::scene_hash(parsed(full, sets)); };
    const auto same = hash({});
    EXPECT_EQ(same.size(), 16u);
    for (const char* set :
         {"title=other", "time.end=2", "output.every=0.1", "output.directory=elsewhere", "output.grain=0.1", "space.h=1.25"})
        EXPECT_EQ(hash({set}), same) << set;
    for (const char* set :
         {"time.step=2e-4", "space.h=1.3", "soil.clay.cohesion=4701", "body.0.velocity=[0,0,0]", "wall.1.surface=rough",
          "effects.gravity=[0,0,-9.8]", "accuracy.kernel=cubic spline", "accuracy.precision=double", "body.2.soil=sand",
          "effects.damping.until=0.4", "body.3.polygon.y=[0.0,0.9]", "space.periodic=[\"x\",\"y\"]", "soil.sand.friction_angle=25.4"})
        EXPECT_NE(hash({set}), same) << set;
    auto renamed = parsed(full);
    renamed.soils[0].name = "gravel";
    EXPECT_EQ(io::scene_hash(renamed), same);
    // "auto" that turns out off is the same physics as nothing written.
    EXPECT_EQ(io::scene_hash(parsed(least, {"effects.artificial_stress=auto"})), io::scene_hash(parsed(least)));
}

TEST(SceneFile, ReferenceNamesEveryKey)
{
    const auto reference = io::scene_reference();
    for (const auto& key : io::scene_keys()) EXPECT_THAT(reference, HasSubstr(std::string(key.leaf() == "*" ? "soil" : key.leaf())));
    EXPECT_THAT(reference, HasSubstr("## `[[body]]`"));
    EXPECT_THAT(reference, HasSubstr("| `spacing` | number | m | needed | 1e-06 <= x <= 1e+06 |"));
}

TEST(SceneKeys, EveryExampleAndDefaultIsLegal)
{
    // Examples stand in messages: they must not lead into the next error.
    for (const auto& key : io::scene_keys()) {
        if (key.path.find('*') != key.path.npos || key.kind == io::Kind::Table || key.kind == io::Kind::Tables ||
            key.kind == io::Kind::Named)
            continue;
        for (const auto& value : {key.example, key.fallback}) {
            if (value.empty()) continue;
            const auto message = refusal(full, {key.path + "=" + value, "effects.gravity=[0,0,-9.81]"});
            EXPECT_THAT(message, ::testing::Not(HasSubstr("--set " + key.path + "=" + value + ": " + key.path + ": expected a "))) << value;
        }
    }
}

TEST(SceneKeys, EveryKeySaysWhatItIs)
{
    std::set<std::string> paths;
    for (const auto& key : io::scene_keys()) {
        EXPECT_TRUE(paths.insert(key.path).second) << key.path << " twice";
        EXPECT_FALSE(key.example.empty() || key.doc.empty()) << key.path;
        EXPECT_EQ(key.need == io::Need::Default, !key.fallback.empty()) << key.path;
    }
    EXPECT_EQ(io::scene_keys().find("output.picture.view")->role, io::Role::Bookkeeping); // its section's
    EXPECT_EQ(io::scene_keys().find("accuracy.kernel")->role, io::Role::Physics);
}

TEST(SceneKeys, EveryWordOfAChoiceIsWrittenAsItWasRead)
{
    int words = 0;
    for (const auto& key : io::scene_keys()) {
        if (key.kind != io::Kind::Choice && key.kind != io::Kind::ChoiceOrTable) continue;
        if (key.path.starts_with("terrain.")) continue; // needs files: tests/cli/terrain_test.py
        if (key.path.starts_with("event.")) continue;   // needs a time beside it: tests/cli/stages_test.py
        auto path = key.path;
        if (const auto star = path.find('*'); star != path.npos) path.replace(star, 1, path.starts_with("soil") ? "sand" : "0");
        std::set<std::string> hashes;
        for (const auto& word : key.choices) {
            const auto scene = parsed(full, {path + "=" + word, "soil.sand.dilation_angle=0"});
            EXPECT_THAT(io::write_scene(scene), HasSubstr(fmt::format("{} = \"{}\"", key.leaf(), word))) << path;
            if (path.starts_with("accuracy.") && path != "accuracy.preset") hashes.insert(io::scene_hash(scene));
            ++words;
        }
        EXPECT_TRUE(hashes.empty() || hashes.size() == key.choices.size()) << path << ": two words, one meaning";
    }
    EXPECT_GT(words, 20);
}

TEST(SceneKeys, WordsMeanTheirValues)
{
    const auto with = [](const char* set) { return parsed(full, {set, "soil.sand.dilation_angle=0"}); };
    EXPECT_EQ(with("soil.sand.cone=compression").soils[0].cone, scene::Cone::Compression);
    EXPECT_EQ(with("soil.sand.cone=extension").soils[0].cone, scene::Cone::Extension);
    EXPECT_EQ(with("soil.sand.cone=plane strain").soils[0].cone, scene::Cone::PlaneStrain);
    EXPECT_EQ(with("accuracy.kernel=cubic spline").accuracy.kernel, scene::Kernel::CubicSpline);
    EXPECT_EQ(with("accuracy.precision=double").accuracy.precision, scene::Precision::Double);
    EXPECT_EQ(with("accuracy.correction=gradient").accuracy.correction, scene::Correction::Gradient);
    EXPECT_EQ(with("wall.0.surface=smooth").walls[0].surface, scene::Surface::Smooth);
    EXPECT_EQ(with("output.picture.view=cut").output.picture->view, scene::View::Slice);
    EXPECT_EQ(with("output.picture.color=pressure").output.picture->color, scene::Color::Pressure);
    for (const auto& preset : io::presets()) EXPECT_EQ(with(("accuracy.preset=" + preset.name).c_str()).accuracy.preset, preset.value);
}

TEST(SceneKeys, DefaultsOfFilesAreThoseOfTheStructs)
{
    const auto s = parsed(least, {"effects.artificial_stress={}", "effects.stress_diffusion={}", "output.picture={}"});
    EXPECT_EQ(s.accuracy, scene::Accuracy{});
    EXPECT_EQ(s.space.h, scene::Space{}.h);
    EXPECT_EQ(s.time.retry, scene::Time{}.retry);
    EXPECT_EQ(s.effects.artificial_stress, scene::ArtificialStress{});
    EXPECT_EQ(s.effects.stress_diffusion, scene::StressDiffusion{});
    scene::Output output;
    output.picture.emplace();
    EXPECT_EQ(s.output, output);
    const scene::Soil soil{};
    EXPECT_EQ(s.soils[0].cohesion, soil.cohesion);
    EXPECT_EQ(s.soils[0].dilation_angle, soil.dilation_angle);
    EXPECT_EQ(s.soils[0].cone, soil.cone);
    EXPECT_EQ(s.bodies[0].velocity, scene::Body{}.velocity);
    EXPECT_EQ(s.bodies[0].stress, scene::Body{}.stress);
}

TEST(SceneKeys, NearestWordIsFound)
{
    EXPECT_EQ(io::edit_distance("kernel", "kernel"), 0);
    EXPECT_EQ(io::edit_distance("kenrel", "kernel"), 1);
    EXPECT_EQ(io::edit_distance("", "abc"), 3);
    EXPECT_EQ(io::nearest("frction_angle", {"friction_angle", "dilation_angle"}), "friction_angle");
    EXPECT_EQ(io::nearest("x", {}), "");
}
