#include "io/batch_template.hpp"
#include "io/file.hpp"
#include "io/keys.hpp"
#include "io/quote.hpp"
#include "io/trim.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sstream>

namespace kuzure::io {
namespace {

constexpr std::string_view ending = ".job.sh";
constexpr int deepest_include = 8;
constexpr std::uint64_t most_bytes = 1 << 20;

class Filler {
public:
    Filler(const BatchValues& values, const std::vector<std::filesystem::path>& folders) : values_(values), folders_(folders) {}

    std::string fill(const std::filesystem::path& file, int depth = 0)
    {
        struct Open {
            std::size_t line;
            bool holds;
        };
        std::vector<Open> open; // the ifs around this line
        std::string out, line;
        std::istringstream text(read_text(Place(file), most_bytes));
        const auto outer = at_;
        at_ = {file, 0};
        while (std::getline(text, line)) {
            ++at_.line;
            const bool holds = std::all_of(open.begin(), open.end(), [](const Open& o) { return o.holds; });
            const auto word = statement(line);
            if (line.starts_with("##")) continue;
            if (word == "end") {
                if (open.empty()) wrong("{{end}}", "expected {{if NAME}} before it, found none; remove it");
                open.pop_back();
            } else if (word.starts_with("if ")) {
                std::string name = trimmed(word.substr(3), in_a_line);
                const bool negated = name.starts_with("not ");
                if (negated) name = trimmed(name.substr(4), in_a_line);
                open.push_back({at_.line, has(name) != negated});
            } else if (word.starts_with("include ")) {
                const std::string name = trimmed(word.substr(8), in_a_line);
                // Beside the template that asks first: parts of a site's own.
                std::vector<std::filesystem::path> where{file.parent_path()};
                where.insert(where.end(), folders_.begin(), folders_.end());
                const auto part = name.find('/') == name.npos ? template_file(name, where) : std::filesystem::path();
                if (part.empty())
                    wrong("{{" + word + "}}", fmt::format("expected a file beside the template or in {}, found none of this name",
                                                          fmt::join(as_text(folders_), ", ")));
                if (depth == deepest_include) wrong("{{" + word + "}}", "expected parts that end, found one that includes itself");
                if (holds) out += fill(part, depth + 1);
            } else if (const std::string filled_in = filled(line); holds) {
                out += filled_in;
            }
        }
        if (!open.empty()) {
            at_.line = open.back().line;
            wrong("{{if}}", "expected {{end}} after it, found the end of the file; write it where the lines end that need the condition");
        }
        at_ = outer;
        return out;
    }

private:
    struct At {
        std::filesystem::path file;
        std::size_t line;
    };

    [[noreturn]] void wrong(const std::string& what, const std::string& text) const
    {
        throw BadInput(fmt::format("{}:{}: {}: {}", at_.file.string(), at_.line, printable(what), printable(text)));
    }

    static std::vector<std::string> as_text(const std::vector<std::filesystem::path>& folders)
    {
        std::vector<std::string> out;
        for (const auto& f : folders) out.push_back(f.string());
        return out;
    }

    /// What stands in {{...}} where the line is nothing else and no value's name; else empty.
    std::string statement(const std::string& line) const
    {
        const std::string alone = trimmed(line);
        if (!alone.starts_with("{{") || !alone.ends_with("}}") || alone.find("{{", 2) != alone.npos) return "";
        const std::string word = trimmed(alone.substr(2, alone.size() - 4));
        return word == "end" || word.starts_with("if ") || word.starts_with("include ") ? word : "";
    }

    const BatchValue& value(const std::string& name) const
    {
        const auto found = values_.find(name);
        if (found != values_.end()) return found->second;
        std::vector<std::string> known;
        for (const auto& [k, v] : values_) known.push_back(k);
        wrong("{{" + name + "}}", fmt::format("expected a placeholder, found none of this name{} Known: {}", did_you_mean(name, known),
                                              fmt::join(known, ", ")));
    }

    bool has(const std::string& name) const
    {
        const auto& v = value(name);
        return std::any_of(v.lines.begin(), v.lines.end(), [](const std::string& s) { return !s.empty(); });
    }

    /// The line, or the lines, with every placeholder filled in.
    std::string filled(const std::string& line) const
    {
        std::vector<std::string> whole{""}; // one for each element of the list on this line
        const std::vector<std::string>* list = nullptr;
        std::size_t at = 0;
        for (auto next = line.find("{{"); next != line.npos; next = line.find("{{", at)) {
            const auto end = line.find("}}", next);
            if (end == line.npos) wrong(line.substr(next, 40), "expected }} after {{, found the end of the line");
            const std::string name = trimmed(line.substr(next + 2, end - next - 2));
            const auto& v = value(name);
            for (auto& w : whole) w += line.substr(at, next - at);
            if (v.kind == BatchValue::Kind::Lines || v.kind == BatchValue::Kind::Options) {
                if (list) wrong("{{" + name + "}}", "expected one list on a line, found a second; give it a line of its own");
                list = &v.lines;
                const std::string before = whole[0];
                whole.clear();
                for (const auto& one : v.lines)
                    whole.push_back(v.kind == BatchValue::Kind::Options && one.starts_with("#") ? one : before + one);
            } else {
                if (v.kind == BatchValue::Kind::Word && inside_quotes(line.substr(0, next)))
                    wrong("{{" + name + "}}", "expected it outside quotes, found it inside; it brings its own: remove those around it");
                for (auto& w : whole) w += v.lines.empty() ? "" : v.lines[0];
            }
            at = end + 2;
        }
        std::string out;
        for (auto& w : whole) {
            w += line.substr(at);
            // An empty value leaves no blank where a command begins.
            if (line.starts_with("{{") && !w.empty() && w[0] == ' ') w.erase(0, w.find_first_not_of(' '));
            out += w + "\n";
        }
        return out;
    }

    static bool inside_quotes(const std::string& before)
    {
        char quote = 0;
        for (std::size_t k = 0; k < before.size(); ++k) {
            const char c = before[k];
            if (quote != '\'' && c == '\\') ++k;
            else if (quote == 0 && (c == '\'' || c == '"')) quote = c;
            else if (c == quote) quote = 0;
        }
        return quote != 0;
    }

    const BatchValues& values_;
    const std::vector<std::filesystem::path>& folders_;
    At at_{};
};

} // namespace

std::filesystem::path template_file(const std::string& name, const std::vector<std::filesystem::path>& folders)
{
    std::error_code error;
    for (const auto& folder : folders)
        if (std::filesystem::is_regular_file(folder / name, error)) return folder / name;
    return {};
}

std::vector<std::string> batch_systems(const std::vector<std::filesystem::path>& folders)
{
    std::vector<std::string> names;
    std::error_code error;
    for (const auto& folder : folders)
        for (const auto& entry : std::filesystem::directory_iterator(folder, error))
            if (const auto name = entry.path().filename().string(); name.ends_with(ending) && name.size() > ending.size())
                names.push_back(name.substr(0, name.size() - ending.size()));
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

std::string fill_template(const std::filesystem::path& file, const BatchValues& values, const std::vector<std::filesystem::path>& folders)
{
    return Filler(values, folders).fill(file);
}

} // namespace kuzure::io
