#include "io/scene_keys.hpp"
#include "io/scene_description.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <fmt/format.h>

namespace kuzure::io {
namespace {

std::vector<Preset> make_presets()
{
    const auto preset = [](scene::Preset value, const char* name, const char* doc, const char* kernel, const char* norm, const char* h,
                           const char* cfl, const char* scheme, const char* precision, const char* correction, const char* skin) {
        const auto quoted = [](const char* s) { return fmt::format("\"{}\"", s); };
        return Preset{value,
                      name,
                      doc,
                      {{"space.h", h},
                       {"accuracy.kernel", quoted(kernel)},
                       {"accuracy.kernel_norm", quoted(norm)},
                       {"accuracy.cfl", cfl},
                       {"accuracy.scheme", quoted(scheme)},
                       {"accuracy.precision", quoted(precision)},
                       {"accuracy.correction", quoted(correction)},
                       {"accuracy.skin", skin}}};
    };
    using enum scene::Preset;
    return {
        preset(Seed, "seed", "as the paper: its step of 1e-4 s is a Courant number of 0.075", "cubic spline", "continuum", "1.2", "0.075",
               "leap-frog", "double", "none", "0.1"),
        preset(Fast, "fast", "least time for a first look", "cubic spline", "lattice", "1.2", "1.4", "staggered", "mixed", "none", "0.2"),
        preset(Standard, "standard", "least error for its time", "wendland c2", "lattice", "1.3", "1.0", "staggered", "double", "none",
               "0.2"),
        preset(Accurate, "accurate", "least error at a spacing", "wendland c2", "lattice", "1.5", "0.6", "staggered", "double", "none",
               "0.2")};
}

/// Visits describe() and makes a row of every key.
class Collector {
public:
    std::vector<Key> keys;

    void section(const char* path, const KeyInfo& k) { add(path, Kind::Table, k); }
    void text(const std::string& path, const std::string&, const KeyInfo& k) { add(path, Kind::Text, k); }
    void integer(const std::string& path, int, const KeyInfo& k) { add(path, Kind::Integer, k); }
    void integer(const std::string& path, const std::optional<int>&, const KeyInfo& k)
    {
        add(path, Kind::Integer, k).need = Need::Optional;
    }
    void flag(const std::string& path, bool, const KeyInfo& k) { add(path, Kind::Flag, k); }
    void number(const std::string& path, const double&, const KeyInfo& k) { add(path, Kind::Number, k); }
    void number(const std::string& path, const std::optional<double>&, const KeyInfo& k)
    {
        add(path, Kind::Number, k).need = Need::Optional;
    }
    void angle(const std::string& path, const double&, const KeyInfo& k) { add(path, Kind::Number, k); }
    void angle(const std::string& path, const std::optional<double>&, const KeyInfo& k)
    {
        add(path, Kind::Number, k).need = Need::Optional;
    }
    void vector(const std::string& path, const Vector&, const KeyInfo& k) { add(path, Kind::Vector, k); }
    void vector(const std::string& path, const std::optional<Vector>&, const KeyInfo& k)
    {
        add(path, Kind::Vector, k).need = Need::Optional;
    }
    void pair(const std::string& path, const std::array<double, 2>&, const KeyInfo& k) { add(path, Kind::Pair, k); }
    void numbers(const std::string& path, const std::vector<double>&, const KeyInfo& k) { add(path, Kind::Numbers, k); }
    void files(const std::string& path, const std::vector<std::string>&, const KeyInfo& k) { add(path, Kind::TextOrTexts, k); }
    void some_names(const std::string& path, const std::vector<std::string>&, const KeyInfo& k) { add(path, Kind::TextOrTexts, k); }
    void window(const std::string& path, const std::optional<std::array<double, 4>>&, const KeyInfo& k)
    {
        add(path, Kind::Window, k).need = Need::Optional;
    }
    void points(const std::string& path, const std::vector<std::array<double, 2>>&, const KeyInfo& k) { add(path, Kind::Points, k); }
    void axes(const std::string& path, const std::array<bool, 3>&, const KeyInfo& k)
    {
        add(path, Kind::Choices, k).choices = {"x", "y", "z"};
    }
    void choices(const std::string& path, const std::vector<std::string>&, std::initializer_list<const char*> words, const KeyInfo& k)
    {
        add(path, Kind::Choices, k).choices.assign(words.begin(), words.end());
    }
    template <class Enum>
    void choice(const std::string& path, const Enum&, const std::type_identity_t<Words<Enum>>& words, const KeyInfo& k)
    {
        add(path, Kind::Choice, k).choices = choices_of(words);
    }
    template <class Enum>
    void choice(const std::string& path, const std::optional<Enum>&, const std::type_identity_t<Words<Enum>>& words, const KeyInfo& k)
    {
        choice(path, Enum{}, words, k);
    }
    template <class Enum, class Describe>
    void choice_or_table(const std::string& path, const Enum&, const std::type_identity_t<Words<Enum>>& words, Enum, const KeyInfo& k,
                         Describe describe)
    {
        add(path, Kind::ChoiceOrTable, k).choices = choices_of(words);
        describe(path);
    }
    template <class T, class Describe> void table(const std::string& path, const std::optional<T>&, const KeyInfo& k, Describe describe)
    {
        add(path, Kind::Table, k).need = Need::Optional;
        T value{};
        describe(path, value);
    }
    template <class T, class Describe> void part(const std::string& path, const std::optional<T>& to, const KeyInfo& k, Describe describe)
    {
        table(path, to, k, describe);
    }
    template <class T, class Describe>
    void automatic(const std::string& path, const std::optional<T>& to, scene::Decision, const KeyInfo& k, Describe describe)
    {
        const auto row = keys.size();
        table(path, to, k, describe);
        keys[row].kind = Kind::ChoiceOrTable, keys[row].choices = {"auto"};
    }
    template <class T, class Describe> void tables(const std::string& path, const std::vector<T>&, const KeyInfo& k, Describe describe)
    {
        add(path, Kind::Tables, k);
        T element{};
        describe(path + ".*", element);
    }
    template <class Describe> void soils(const std::string& path, const std::vector<scene::Soil>&, const KeyInfo& k, Describe describe)
    {
        add(path, Kind::Named, k);
        add(path + ".*", Kind::Table, {.optional = true, .example = k.example, .doc = "one soil"});
        scene::Soil soil{};
        describe(path + ".*", soil);
    }
    template <class Describe>
    void soil_changes(const std::string& path, const std::vector<scene::SoilChange>&, const std::vector<scene::Soil>&, const KeyInfo& k,
                      Describe describe)
    {
        add(path, Kind::Named, k);
        add(path + ".*", Kind::Table, {.optional = true, .example = k.example, .doc = "one soil"});
        scene::SoilChange change{};
        describe(path + ".*", change);
    }
    void soil_of(const std::string& path, int, const std::vector<scene::Soil>&, const KeyInfo& k) { add(path, Kind::Text, k); }
    template <class T, class Describe> void alternative(const std::string& path, const scene::Shape&, const KeyInfo& k, Describe describe)
    {
        add(path, Kind::Table, k).need = Need::OneOf;
        T shape{};
        describe(path, shape);
    }

private:
    Key& add(const std::string& path, Kind kind, const KeyInfo& k)
    {
        const std::string head = path.substr(0, path.find('.'));
        const auto section = std::find_if(keys.begin(), keys.end(), [&](const Key& key) { return key.path == head; });
        const Role role = section == keys.end() ? k.role : std::max(k.role, section->role);
        const Need need = k.optional ? Need::Optional : *k.fallback ? Need::Default : Need::Required;
        return keys.emplace_back(Key{path, kind, k.unit, need, k.fallback, k.range, {}, k.example, k.doc, role});
    }
};

std::vector<Key> make_keys()
{
    Collector collector;
    Scene scene;
    describe(collector, scene);
    std::optional<scene::Uncertain> uncertain;
    describe_uncertain(collector, uncertain);
    auto& keys = collector.keys;
    const auto row = [&](std::string_view path) -> Key& {
        const auto found = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.path == path; });
        ensure(found != keys.end(), "a preset sets a key that no scene has");
        return *found;
    };
    const std::string standard = row("accuracy.preset").fallback;
    for (const auto& preset : presets())
        if (fmt::format("\"{}\"", preset.name) == standard)
            for (const auto& [path, value] : preset.settings) row(path).need = Need::Default, row(path).fallback = value;
    return std::move(keys);
}

} // namespace

const std::vector<Preset>& presets()
{
    static const std::vector<Preset> all = make_presets();
    return all;
}

const Words<scene::Preset>& preset_words()
{
    static const auto words = [] {
        Words<scene::Preset> all;
        for (const auto& p : presets()) all.push_back({p.name.c_str(), p.value});
        return all;
    }();
    return words;
}

const KeyTable& scene_keys()
{
    static const KeyTable keys("a scene", make_keys());
    return keys;
}

} // namespace kuzure::io
