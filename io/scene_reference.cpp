// The keys of a scene for people (Markdown) and for editors (JSON Schema).
#include "io/document.hpp"
#include "io/scene_file.hpp"
#include "io/scene_keys.hpp"
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <sstream>

namespace kuzure::io {
namespace {

using Json = nlohmann::ordered_json;

// ---- Markdown ----

/// What a value looks like, as the reference says it.
std::string shown_value(const Key& key)
{
    const auto words = [&] { return fmt::format("`\"{}\"`", fmt::join(key.choices, "\"`, `\"")); };
    switch (key.kind) {
    case Kind::Text:
        return "string";
    case Kind::Number:
        return "number";
    case Kind::Integer:
        return "integer";
    case Kind::Flag:
        return "true or false";
    case Kind::Vector:
        return "[x, y, z]";
    case Kind::Pair:
        return "[from, to]";
    case Kind::Points:
        return "[[x, z], ...]";
    case Kind::Window:
        return "[x from, y from, x to, y to]";
    case Kind::Numbers:
        return "array of numbers";
    case Kind::Choice:
        return words();
    case Kind::Choices:
        return "array of " + words();
    case Kind::ChoiceOrTable:
        return words() + " or table";
    case Kind::Table:
        return "table";
    case Kind::Texts:
        return "array of strings";
    case Kind::TextOrTexts:
        return "string or array of strings";
    case Kind::TextOrTrue:
        return "string or true";
    case Kind::Settings:
        return "table of settings";
    case Kind::Tables:
    case Kind::Named:
        break; // these are headings
    }
    return "";
}
std::string shown_default(const Key& key)
{
    switch (key.need) {
    case Need::Required:
        return "needed";
    case Need::Optional:
        return "none";
    case Need::OneOf:
        return "one of these";
    case Need::Default:
        break;
    }
    return "`" + key.fallback + "`";
}

// ---- JSON Schema ----

Json json_of(const std::string& toml)
{
    std::ostringstream out;
    out << toml::json_formatter{toml::parse("v = " + toml)};
    return Json::parse(out.str()).at("v");
}
Json number_schema(const Key& key, const char* type)
{
    Json j{{"type", type}};
    if (std::isfinite(key.range.low)) j[key.range.low_open ? "exclusiveMinimum" : "minimum"] = key.range.low;
    if (std::isfinite(key.range.high)) j[key.range.high_open ? "exclusiveMaximum" : "maximum"] = key.range.high;
    return j;
}
Json array_of(Json items, int least, int most = 0)
{
    Json j{{"type", "array"}, {"items", std::move(items)}};
    if (least > 0) j["minItems"] = least;
    if (most > 0) j["maxItems"] = most;
    return j;
}
void insert_all(Json& into, const Json& from)
{
    for (const auto& [name, value] : from.items()) into[name] = value;
}

Json table_schema(const std::string& pattern);

/// What a value must be.
Json value_schema(const Key& key)
{
    const int least = key.need == Need::Required ? 1 : 0;
    switch (key.kind) {
    case Kind::Text:
        return {{"type", "string"}};
    case Kind::Number:
        return number_schema(key, "number");
    case Kind::Integer:
        return number_schema(key, "integer");
    case Kind::Flag:
        return {{"type", "boolean"}};
    case Kind::Vector:
        return array_of(number_schema(key, "number"), 3, 3);
    case Kind::Pair:
        return array_of(number_schema(key, "number"), 2, 2);
    case Kind::Window:
        return array_of(number_schema(key, "number"), 4, 4);
    case Kind::Points:
        return array_of(array_of(number_schema(key, "number"), 2, 2), 0);
    case Kind::Numbers:
        return array_of(number_schema(key, "number"), 0);
    case Kind::Choice:
        return {{"enum", key.choices}};
    case Kind::Choices: {
        auto j = array_of({{"enum", key.choices}}, 1);
        j["uniqueItems"] = true;
        return j;
    }
    case Kind::ChoiceOrTable:
        return {{"anyOf", Json::array({Json{{"enum", key.choices}}, table_schema(key.path)})}};
    case Kind::Table:
        return table_schema(key.path);
    case Kind::Tables:
        return array_of(table_schema(key.path + ".*"), least);
    case Kind::Named:
        return {{"type", "object"},
                {"patternProperties", {{"^[A-Za-z0-9_-]+$", table_schema(key.path + ".*")}}},
                {"additionalProperties", false},
                {"minProperties", 1}};
    case Kind::Texts:
        return array_of({{"type", "string"}}, 0);
    case Kind::TextOrTexts:
        return {{"anyOf", Json::array({Json{{"type", "string"}}, array_of({{"type", "string"}}, 1)})}};
    case Kind::TextOrTrue:
        return {{"anyOf", Json::array({Json{{"type", "string"}}, Json{{"const", true}}})}};
    case Kind::Settings: {
        auto j = table_schema(key.path);
        j["additionalProperties"] = true;
        return j;
    }
    }
    return {};
}
/// The same, with its words for the editor.
Json key_schema(const Key& key)
{
    const std::string unit = key.unit.empty() || key.unit == "1" ? "" : fmt::format(" [{}]", key.unit);
    Json j{{"description", key.doc + unit}};
    insert_all(j, value_schema(key));
    if (key.need == Need::Default) j["default"] = json_of(key.fallback);
    if (key.kind != Kind::Tables && key.kind != Kind::Named) j["examples"] = Json::array({json_of(key.example)});
    return j;
}
/// A table of which these keys are known; the top level is "".
Json table_schema(const std::string& pattern)
{
    auto properties = Json::object(), needed = Json::array(), alternatives = Json::array();
    for (const Key* key : scene_keys().inside(pattern)) {
        const std::string name(key->leaf());
        properties[name] = key_schema(*key);
        if (key->need == Need::Required) needed.push_back(name);
        if (key->need == Need::OneOf) alternatives.push_back({{"required", Json::array({name})}});
    }
    Json j{{"type", "object"}, {"properties", properties}, {"additionalProperties", false}};
    if (!needed.empty()) j["required"] = needed;
    if (!alternatives.empty()) j["oneOf"] = alternatives;
    return j;
}

} // namespace

std::string scene_reference()
{
    std::string out = "# Scene file reference\n\n"
                      "Lengths in m, masses in kg, times in s, stresses in Pa, angles in degrees. Tension is positive, z is up.\n"
                      "Presence is the switch: what is not written is not simulated.\n";
    std::string section = "none";
    for (const Key& key : scene_keys()) {
        const bool group =
            key.kind == Kind::Named || key.kind == Kind::Tables || (key.kind == Kind::Table && key.path.find('.') == key.path.npos);
        const auto one_of_many = key.path.find(".*"), dot = key.path.find('.');
        const std::string head = dot == key.path.npos ? "" : key.path.substr(0, one_of_many == key.path.npos ? dot : one_of_many);
        const std::string here = group ? key.path : head;
        if (key.path == "soil.*") continue;
        if (here != section) {
            section = here;
            const Key* parent = here.empty() ? nullptr : scene_keys().find(here);
            const std::string title = !parent                        ? "Top level"
                                      : parent->kind == Kind::Tables ? fmt::format("`[[{}]]`", here)
                                      : parent->kind == Kind::Named  ? fmt::format("`[{}.<name>]`", here)
                                                                     : fmt::format("`[{}]`", here);
            out += fmt::format("\n## {}\n\n", title);
            if (parent) out += fmt::format("{}{}.\n\n", parent->doc, parent->need == Need::Required ? "; needed" : "");
            out += "| key | value | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
        }
        if (group) continue;
        std::string name = key.path.substr(here.empty() ? 0 : here.size() + 1);
        if (name.starts_with("*.")) name.erase(0, 2);
        out += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name, shown_value(key), key.unit, shown_default(key), key.range.text(),
                           key.doc);
    }
    return out;
}

std::string scene_schema()
{
    Json j{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "Scene of kuzure"}};
    insert_all(j, table_schema(""));
    return j.dump(2) + "\n";
}

} // namespace kuzure::io
