#include "solver/app/cli/help.hpp"
#include "solver/app/cli/options.hpp"
#include <fmt/format.h>
#include <sstream>

namespace kuzure {

namespace {

constexpr std::size_t columns = 100, left = 30;

/// The same words in lines of at most `width`.
std::string wrapped(const std::string& text, std::size_t width)
{
    std::istringstream words(text);
    std::string out, word;
    std::size_t used = 0;
    while (words >> word) {
        if (used > 0 && used + 1 + word.size() > width) out += '\n', used = 0;
        else if (used > 0) out += ' ', ++used;
        out += word, used += word.size();
    }
    return out;
}

/// CLI11's page with descriptions wrapped (CLI11 indents the right column at every line break), short names of values, and
/// one empty line where it leaves several.
class Page final : public CLI::Formatter {
public:
    Page() { column_width(left); }
    std::string make_option_desc(const CLI::Option* o) const override { return wrapped(Formatter::make_option_desc(o), columns - left); }
    std::string make_option_name(const CLI::Option* o, bool positional) const override
    {
        const std::string name = Formatter::make_option_name(o, positional);
        return takes_optional_value(o) ? fmt::format("{}[={}]", name.substr(0, name.find('{')), value_of(o)) : name;
    }
    std::string make_option_opts(const CLI::Option* o) const override
    {
        if (o->get_positional() || takes_optional_value(o)) return "";
        std::string out = value_of(o).empty() ? "" : " " + value_of(o);
        if (!o->get_default_str().empty()) out += "=" + o->get_default_str();
        return out + (o->get_required() ? " (needed)" : "");
    }
    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override
    {
        std::string page = Formatter::make_help(app, name, mode);
        for (auto at = page.find("\n\n\n"); at != page.npos; at = page.find("\n\n\n", at)) page.erase(at, 1);
        return page;
    }
    std::string make_subcommand(const CLI::App* command) const override
    {
        std::ostringstream out;
        CLI::detail::format_help(out, command->get_name(), wrapped(command->get_description(), columns - left), left);
        return out.str();
    }
};

} // namespace

void fit_help_to_screen(CLI::App& app) { app.formatter(std::make_shared<Page>()); }

void under_heading(CLI::App& command, const char* heading, std::initializer_list<const char*> options)
{
    for (const char* name : options) command.get_option(name)->group(heading);
}

} // namespace kuzure
