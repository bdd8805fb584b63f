#include "solver/app/cli/options.hpp"

namespace kuzure {

std::string value_of(const CLI::Option* o)
{
    if (takes_optional_value(o)) return "FILE";
    const std::string name = o->get_type_size() != 0 ? o->get_type_name() : "";
    return name.substr(0, name.find(':'));
}

Command table_of(const CLI::App& app)
{
    Command c{app.get_name(), app.get_description(), {}, {}};
    for (const CLI::Option* o : app.get_options([](const CLI::Option* o) { return !o->get_group().empty(); })) {
        Item item{{}, value_of(o), o->get_description(), o->get_group(), takes_optional_value(o)};
        for (const auto& n : o->get_lnames()) item.names.push_back("--" + n);
        for (const auto& n : o->get_snames()) item.names.push_back("-" + n);
        if (o->get_positional()) item.names = {o->get_name(true)}, item.value = item.names[0];
        (o->get_positional() ? c.arguments : c.options).push_back(item);
    }
    return c;
}

std::vector<Command> commands_of(const CLI::App& program)
{
    std::vector<Command> all;
    for (const CLI::App* c : program.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); }))
        all.push_back(table_of(*c));
    return all;
}

} // namespace kuzure
