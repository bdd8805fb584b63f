#include "io/sweep_file.hpp"
#include "io/document.hpp"
#include "io/scene_keys.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <functional>
#include <map>
#include <sstream>

namespace kuzure::io {
namespace {

const std::size_t most_points = 10000;
const char* const name_of_base = "base";

using Settings = std::vector<std::pair<std::string, std::string>>; // key, value as TOML

/// The keys of a sweep. Settings are keys of a scene, which are checked when they are read.
const KeyTable& sweep_keys()
{
    using enum Kind;
    using enum Need;
    const Range any{};
    static const KeyTable keys(
        "a sweep",
        {
            {"title", Text, "", Optional, "", any, {}, "\"error against time\"", "what it is for; without it the file's name"},
            {"scene", Text, "", Required, "", any, {}, "\"column.toml\"", "path of the scene file, from the sweep's directory"},
            {"threads", Integer, "", Default, "1", between(1, 4096), {}, "1", "threads of every run"},
            {"grain", Number, "m", Optional, "", between(1e-9, 1e9), {}, "0.005", "height at which the run-out is taken"},
            {"measures", Choices, "", Required, "", any, measure_names(), "[\"profile\"]", "what is compared, the most important first"},

            {"reference", Table, "", Default, "{ finest = true }", any, {}, "{ finest = true }", "what errors count from"},
            {"reference.finest", TextOrTrue, "", OneOf, "", any, {}, "true", "the finest run, of this curve where it is a name"},
            {"reference.closed_form", Choice, "", OneOf, "", any, {"k0 column"}, "\"k0 column\"", "a solution in closed form"},
            {"reference.profile", Text, "", OneOf, "", any, {}, "\"surface.csv\"", "an experiment's surface: CSV of x, z in m"},
            {"reference.failure", Text, "", Optional, "", any, {}, "\"failure.csv\"", "its failure line"},
            {"reference.scatter", Number, "1", Default, "0.0", between(0, 1), {}, "0.05", "below which no error means anything"},

            {"base", Settings, "", Optional, "", any, {}, "{ preset = \"fast\" }", "settings of every point"},
            {"vary", Settings, "", Optional, "", any, {}, "{ preset = [\"seed\", \"fast\"] }", "lists of values, all against all"},
            {"presets", Settings, "", Optional, "", any, {}, "{ wide = { preset = \"fast\" } }", "named settings"},
            {"point", Tables, "", Optional, "", any, {}, "[[point]]", "one point beside the base"},
            {"point.*", Settings, "", Optional, "", any, {}, "[[point]]", "its settings"},
            {"point.*.name", Text, "", Required, "", any, {}, "\"mixed precision\"", "what figures call it"},
        });
    return keys;
}

/// Reads the tables of one file and knows the line of everything it complains of.
class SweepReader {
public:
    SweepReader(std::string_view text, const Path& name)
        : name_(name.string()), folder_(name.parent_path()), file_(text, name_, sweep_keys())
    {
        file_.check();
    }

    Sweep read()
    {
        Sweep s;
        s.title = file_.find("title") ? filled("title") : Path(name_).stem().string();
        s.scene = from_folder(filled("scene"));
        s.threads = file_.integer("threads");
        if (file_.find("grain")) s.grain = file_.number("grain");
        const auto& names = measure_names();
        for (const auto& word : file_.texts("measures"))
            s.measures.push_back(Measure(std::find(names.begin(), names.end(), word) - names.begin()));
        read_reference(s);
        read_points(s);
        return s;
    }

private:
    [[noreturn]] void refuse(const toml::node* at, const std::string& key, const std::string& why) const
    {
        const auto line = at ? at->source().begin.line : 0;
        throw BadInput(fmt::format("{}:{}: {}: {}", name_, line ? line : 1, key, why));
    }
    std::string text(const toml::node& node, const std::string& key) const
    {
        if (const auto s = node.value<std::string>(); s && node.is_string() && !s->empty()) {
            if (const auto wrong = not_one_line(*s); !wrong.empty())
                refuse(&node, key, fmt::format("expected words of one line, found {}", wrong));
            return *s;
        }
        refuse(&node, key, fmt::format("expected words in quotes, found {}; write, for example, \"fast\"", as_toml(node)));
    }
    const toml::table& table(const toml::node& node, const std::string& key) const
    {
        if (const auto* t = node.as_table()) return *t;
        refuse(&node, key, fmt::format("expected a table, found {}; write [{}]", as_toml(node), key));
    }
    /// A string of the file that says something.
    std::string filled(const std::string& key) const { return text(file_.at(key), key); }
    Path from_folder(const std::string& name) const { return Path(name).is_absolute() ? Path(name) : folder_ / name; }
    static std::string as_toml(const toml::node& node)
    {
        if (const auto* x = node.as_floating_point()) return fmt::format("{}", x->get()); // 0.1, not 0.10000000000000001
        std::ostringstream out;
        node.visit([&](const auto& n) { out << n; });
        return out.str();
    }

    void read_reference(Sweep& s) const
    {
        if (file_.find("reference.profile")) {
            s.reference.kind = SweepReference::Kind::Experiment;
            s.reference.profile = from_folder(filled("reference.profile"));
            if (file_.find("reference.failure")) s.reference.failure = from_folder(filled("reference.failure"));
            s.reference.scatter = file_.number("reference.scatter");
        } else if (file_.find("reference.closed_form")) {
            s.reference.kind = SweepReference::Kind::ClosedForm; // of which there is one
        } else if (file_.at("reference.finest").is_string()) {
            s.reference.curve = filled("reference.finest");
        }
        const auto needs = [&](Measure m, bool met, const char* what) {
            if (!met && std::find(s.measures.begin(), s.measures.end(), m) != s.measures.end())
                refuse(file_.find("reference"), "reference",
                       fmt::format("the measure \"{}\" needs {}; add it or leave the measure out", measure_names()[std::size_t(m)], what));
        };
        const bool closed = s.reference.kind == SweepReference::Kind::ClosedForm;
        needs(Measure::Stress, closed, "closed_form = \"k0 column\"");
        needs(Measure::Settlement, closed, "closed_form = \"k0 column\"");
        needs(Measure::FailureLine, !s.reference.failure.empty() || s.reference.kind == SweepReference::Kind::Finest,
              "failure = \"FILE.csv\"");
    }

    /// The settings of a table: nested tables and quoted keys both give dotted paths.
    void flatten(const toml::table& t, const std::string& head, const std::string& where, Settings& into,
                 const std::vector<std::string>& own) const
    {
        for (const auto& [key, node] : t) {
            const std::string path = head.empty() ? std::string(key.str()) : head + "." + std::string(key.str());
            if (head.empty() && std::find(own.begin(), own.end(), path) != own.end()) continue;
            if (path == "preset") {
                into.emplace_back(path, text(node, where + "preset"));
                continue;
            }
            if (const auto* inside = node.as_table()) {
                flatten(*inside, path, where, into, own);
                continue;
            }
            require_key(node, path, where);
            into.emplace_back(path, as_toml(node));
        }
    }
    void require_key(const toml::node& node, const std::string& path, const std::string& where) const
    {
        if (scene_keys().find(path)) return;
        std::vector<std::string> all;
        for (const Key& k : scene_keys()) all.push_back(k.path);
        refuse(&node, where + path, fmt::format("expected a key of a scene, found \"{}\"{}", path, did_you_mean(path, all)));
    }
    /// The settings with `preset` replaced by what it stands for: every key, so that it holds whatever the scene file says.
    Settings expanded(const Settings& settings, const toml::node& at) const
    {
        Settings out;
        for (const auto& [key, value] : settings) {
            if (key != "preset") {
                out.emplace_back(key, value);
                continue;
            }
            if (const auto own = own_presets_.find(value); own != own_presets_.end()) {
                const auto more = expanded(own->second, at);
                out.insert(out.end(), more.begin(), more.end());
                continue;
            }
            const auto& all = presets();
            const auto found = std::find_if(all.begin(), all.end(), [&, &value = value](const Preset& p) { return p.name == value; });
            if (found == all.end()) {
                std::vector<std::string> names;
                for (const auto& p : all) names.push_back(p.name);
                for (const auto& [name, unused] : own_presets_) names.push_back(name);
                refuse(
                    &at, "preset",
                    fmt::format("expected one of \"{}\", found \"{}\"{}", fmt::join(names, "\", \""), value, did_you_mean(value, names)));
            }
            out.emplace_back("accuracy.preset", fmt::format("\"{}\"", value));
            out.insert(out.end(), found->settings.begin(), found->settings.end());
        }
        return out;
    }
    static std::vector<std::string> sets_of(const Settings& settings)
    {
        std::vector<std::string> sets;
        for (const auto& [key, value] : settings) sets.push_back(key + "=" + value);
        return sets;
    }

    void read_points(Sweep& s)
    {
        if (const auto* node = file_.root.get("presets"))
            for (const auto& [name, preset] : *node->as_table()) {
                const std::string key = "presets." + std::string(name.str());
                for (const auto& p : presets())
                    if (p.name == name.str())
                        refuse(&preset, key, "expected a name of your own, found that of a preset of kuzure; rename it");
                Settings settings;
                flatten(table(preset, key), "", key + ".", settings, {});
                for (const auto& [k, value] : settings)
                    if (k == "preset" &&
                        std::none_of(presets().begin(), presets().end(), [&, &value = value](const auto& p) { return p.name == value; }))
                        refuse(&preset, key + ".preset", fmt::format("expected a preset of kuzure to start from, found \"{}\"", value));
                // What a preset starts from comes first, whatever the order of the file's keys.
                std::stable_partition(settings.begin(), settings.end(), [](const auto& x) { return x.first == "preset"; });
                own_presets_[std::string(name.str())] = settings;
            }
        Settings base;
        const auto* base_node = file_.root.get("base");
        if (base_node) flatten(*base_node->as_table(), "", "base.", base, {});
        std::stable_partition(base.begin(), base.end(), [](const auto& x) { return x.first == "preset"; });

        read_vary(s, base);
        const auto* node = file_.root.get("point");
        if (node) {
            const toml::node& where = base_node ? *base_node : *node;
            s.points.push_back({name_of_base, sets_of(expanded(base, where)), true});
            std::vector<std::string> names{name_of_base};
            for (const auto& element : *node->as_array()) {
                const auto& t = *element.as_table();
                const auto name = text(*t.get("name"), "point.name");
                if (std::find(names.begin(), names.end(), name) != names.end())
                    refuse(&element, "point.name", fmt::format("expected a name of its own, found \"{}\" again; rename it", name));
                names.push_back(name);
                Settings settings = base, more;
                flatten(t, "", "point.", more, {"name"});
                if (more.empty())
                    refuse(&element, "point", "expected a setting beside the name, found none; write, for example, \"accuracy.cfl\" = 0.1");
                settings.insert(settings.end(), more.begin(), more.end());
                s.points.push_back({name, sets_of(expanded(settings, element)), true});
            }
        }
        if (s.points.empty())
            refuse(nullptr, "vary",
                   "expected [vary] or [[point]], found neither; write, for example, [vary] and \"space.spacing\" = [0.02, 0.01]");
    }

    void read_vary(Sweep& s, const Settings& base)
    {
        const auto* node = file_.root.get("vary");
        if (!node) return;
        struct List {
            std::string key;
            std::vector<std::string> values;
        };
        std::vector<List> lists;
        const std::function<void(const toml::table&, const std::string&)> collect = [&](const toml::table& t, const std::string& head) {
            for (const auto& [key, values] : t) {
                const std::string path = head.empty() ? std::string(key.str()) : head + "." + std::string(key.str());
                if (const auto* inside = values.as_table()) {
                    collect(*inside, path);
                    continue;
                }
                const auto* array = values.as_array();
                if (!array || array->empty())
                    refuse(&values, "vary." + path, fmt::format("expected an array of values, found {}; write [ ... ]", as_toml(values)));
                if (path != "preset") require_key(values, path, "vary.");
                List list{path, {}};
                for (const auto& v : *array) {
                    list.values.push_back(path == "preset" ? text(v, "vary.preset") : as_toml(v));
                    if (std::count(list.values.begin(), list.values.end(), list.values.back()) > 1)
                        refuse(&v, "vary." + path,
                               fmt::format("expected each value once, found {} twice; name it once", list.values.back()));
                }
                lists.push_back(std::move(list));
            }
        };
        collect(*node->as_table(), "");
        if (lists.empty())
            refuse(node, "vary", "expected lists of values, found none; write, for example, \"space.spacing\" = [0.02, 0.01]");
        // A preset first: single keys override it.
        std::stable_sort(lists.begin(), lists.end(), [](const List& a, const List& b) { return a.key == "preset" && b.key != "preset"; });
        std::size_t count = 1;
        for (const auto& list : lists)
            if ((count *= list.values.size()) > most_points)
                refuse(node, "vary", fmt::format("expected at most {} points, found more; shorten the lists", most_points));
        for (std::size_t k = 0; k < count; ++k) {
            Settings settings = base;
            std::vector<std::string> words;
            std::size_t remainder = k;
            for (const auto& list : lists) {
                const auto& value = list.values[remainder % list.values.size()];
                remainder /= list.values.size();
                settings.emplace_back(list.key, value);
                if (list.key == "preset") words.push_back(value);
                else if (list.key != "space.spacing")
                    words.push_back(fmt::format("{} {}", list.key.substr(list.key.rfind('.') + 1), value));
            }
            s.points.push_back(
                {words.empty() ? std::string("spacing") : fmt::format("{}", fmt::join(words, ", ")), sets_of(expanded(settings, *node))});
        }
    }

    std::string name_;
    Path folder_;
    Document file_;
    std::map<std::string, Settings> own_presets_;
};

} // namespace

const std::vector<std::string>& measure_names()
{
    static const std::vector<std::string> names{"profile",      "run-out", "height",     "peak speed",
                                                "failure line", "stress",  "settlement", "residual"};
    return names;
}

Sweep parse_sweep(std::string_view text, const Path& name) { return SweepReader(text, name).read(); }

} // namespace kuzure::io
