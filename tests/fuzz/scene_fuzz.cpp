// Any bytes are a scene or a refusal in words: never a crash, a hang or a large use of memory. Input: the text of a
// scene file, then, each after a zero byte, what --set gives. Built for libFuzzer (-DKUZURE_FUZZ=ON), and for the
// replay of the corpus in the normal suite (replay_test.cpp).
#include "io/scene_file.hpp"
#include "solver/core/ensure.hpp"
#include <cstdio>
#include <cstdlib>

using namespace kuzure;

namespace {

[[noreturn]] void found(const char* what)
{
    std::fprintf(stderr, "scene_fuzz: %s\n", what);
    std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    std::string_view all(reinterpret_cast<const char*>(data), size);
    const auto take = [&] {
        const auto end = all.find('\0');
        const auto piece = all.substr(0, end);
        all.remove_prefix(end == all.npos ? all.size() : end + 1);
        return std::string(piece);
    };
    const std::string text = take();
    std::vector<std::string> sets;
    while (!all.empty() && sets.size() < 8) sets.push_back(take());
    try {
        const Scene scene = io::parse_scene(text, "fuzz.toml", sets);
        // What is accepted is written, and reads back to the same scene: results keep their scene.toml.
        const std::string written = io::write_scene(scene);
        Scene again;
        try {
            again = io::parse_scene(written, "written.toml");
        } catch (const BadInput& e) {
            std::fprintf(stderr, "%s\n%s\n", written.c_str(), e.what());
            found("a scene that was accepted is refused when read back");
        }
        if (!(again == scene)) found("a scene reads back as another");
        if (io::scene_hash(again) != io::scene_hash(scene)) found("a scene reads back with another hash");
    } catch (const BadInput& e) {
        const std::string_view message = e.what();
        if (message.empty()) found("a refusal without a word");
        if (message.size() > 100000) found("a refusal of more than 100 kB");
    }
    return 0;
}
