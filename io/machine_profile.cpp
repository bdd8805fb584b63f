#include "io/machine_profile.hpp"
#include "io/batch_template.hpp"
#include "io/document.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::io {
namespace {

const Words<Resubmit> ways_to_resubmit{{"itself", Resubmit::Itself}, {"chain", Resubmit::Chain}};

std::vector<Key> make_keys()
{
    using enum Kind;
    using enum Need;
    const Range any{}, positive{.low = 0, .low_open = true}, count{.low = 1, .high = 1e7};
    return {
        {"title", Text, "", Required, "", any, {}, "\"Oakforest-PACS\"", "what machine this is"},
        {"batch", Text, "", Required, "", any, {}, "\"slurm\"", "its batch system: NAME of a template NAME.job.sh beside the profiles"},
        {"resubmit", Choice, "", Default, "\"itself\"", any, choices_of(ways_to_resubmit), "\"chain\"",
         "a job at its clock limit submits itself again, or jobs are chained beforehand because compute nodes cannot submit"},
        {"needs_account", Flag, "", Default, "false", any, {}, "true", "jobs are refused without a project (--account)"},

        {"node", Table, "", Required, "", any, {}, "{ count = 8208, cores = 64, ranks = 4, memory = 96e9 }", "one node"},
        {"node.count", Integer, "", Required, "", count, {}, "8208", "nodes of the machine"},
        {"node.cores", Integer, "", Optional, "", count, {}, "64", "cores for ranks and threads; without it those of this host"},
        {"node.threads_per_core", Integer, "", Default, "1", {.low = 1, .high = 8}, {}, "1", "threads on each core"},
        {"node.ranks", Integer, "", Required, "", count, {}, "4", "ranks on a node unless --ranks-per-node says otherwise"},
        {"node.memory", Number, "bytes", Optional, "", positive, {}, "96e9", "memory for ranks; without it that of this host"},

        {"launch", Table, "", Required, "", any, {}, "{ command = \"srun\" }", "how ranks are started"},
        {"launch.command",
         Text,
         "",
         Required,
         "",
         any,
         {},
         "\"mpirun -n {ranks}\"",
         "what stands before the program; {ranks}, {per_node}, {nodes} and {threads} are filled in"},
        {"launch.directives", Texts, "", Default, "[]", any, {}, "[\"--exclusive\"]", "further options of the batch system, one a line"},
        {"launch.setup", Texts, "", Default, "[]", any, {}, "[\"module load impi\"]", "shell lines before the launch"},

        {"mode", Named, "", Optional, "", any, {}, "[mode.flat]", "ways to set up a node's memory; the first is the default"},
        {"mode.*", Table, "", Optional, "", any, {}, "[mode.flat]", "one of them"},
        {"mode.*.memory", Number, "bytes", Optional, "", positive, {}, "96e9", "memory for ranks in this mode"},
        {"mode.*.wrapper",
         Text,
         "",
         Default,
         "\"\"",
         any,
         {},
         "\"numactl --preferred=1\"",
         "command that starts the program on every rank"},
        {"mode.*.setup", Texts, "", Default, "[]", any, {}, "[\"export X=1\"]", "shell lines before the launch"},

        {"queue", Named, "", Optional, "", any, {}, "[queue.regular]", "queues; the first that fits is taken"},
        {"queue.*", Table, "", Optional, "", any, {}, "[queue.regular]", "one of them"},
        {"queue.*.mode", Text, "", Default, "\"\"", any, {}, "\"flat\"", "the only mode it serves"},
        {"queue.*.nodes", Pair, "", Required, "", count, {}, "[1, 384]", "fewest and most nodes of a job"},
        {"queue.*.minutes", Number, "min", Required, "", positive, {}, "1440.0", "longest job"},

        {"cost", Table, "", Required, "", any, {}, "[cost]", "constants of the performance model"},
        {"cost.pair_ns",
         Table,
         "",
         Required,
         "",
         any,
         {},
         "{ double = 10.7, mixed = 7.2 }",
         "one core, one directed pair, update included"},
        {"cost.pair_ns.double", Number, "ns", Required, "", positive, {}, "10.7", "in double precision"},
        {"cost.pair_ns.mixed", Number, "ns", Required, "", positive, {}, "7.2", "in mixed precision"},
        {"cost.particle_ns", Number, "ns", Required, "", positive, {}, "59.0", "one core, one soil particle and step beside its pairs"},
        {"cost.memory_bandwidth", Number, "bytes/s", Required, "", positive, {}, "480e9", "of a node"},
        {"cost.latency", Number, "s", Required, "", positive, {}, "1.5e-6", "of a short message between nodes"},
        {"cost.bandwidth", Number, "bytes/s", Required, "", positive, {}, "12.5e9", "into or out of a node"},
    };
}

} // namespace

const KeyTable& machine_keys()
{
    static const KeyTable keys("a machine profile", make_keys());
    return keys;
}

MachineProfile parse_machine_profile(std::string_view text, const std::filesystem::path& file,
                                     const std::vector<std::filesystem::path>& folders)
{
    Document d(text, file.string(), machine_keys());
    d.check();
    const auto number_or_0 = [&](const std::string& key) { return d.find(key) ? d.number(key) : 0; };

    MachineProfile m;
    m.name = file.stem().string(), m.file = file, m.title = d.text("title");
    m.batch = d.text("batch"), m.resubmit = d.choice("resubmit", ways_to_resubmit);
    m.folders = {file.parent_path()};
    m.folders.insert(m.folders.end(), folders.begin(), folders.end());
    if (const auto known = batch_systems(m.folders); std::find(known.begin(), known.end(), m.batch) == known.end())
        d.complain("batch", fmt::format("expected one of {}, found \"{}\"{} Another system needs a template {}.job.sh beside the profile",
                                        fmt::join(known, ", "), m.batch, did_you_mean(m.batch, known), m.batch));
    m.needs_account = d.at("needs_account").as_boolean()->get();
    m.node = {d.integer("node.count"), int(number_or_0("node.cores")), d.integer("node.threads_per_core"), d.integer("node.ranks"),
              number_or_0("node.memory")};
    m.launcher = d.text("launch.command");
    m.directives = d.texts("launch.directives"), m.setup = d.texts("launch.setup");
    std::vector<std::string> modes = d.names("mode");
    for (const auto& name : modes) {
        const auto key = "mode." + name;
        ModeProfile mode{name, d.text(key + ".wrapper"), {}, d.texts(key + ".setup")};
        if (d.find(key + ".memory")) mode.memory = d.number(key + ".memory");
        m.modes.push_back(std::move(mode));
    }
    for (const auto& name : d.names("queue")) {
        const auto key = "queue." + name;
        const auto& nodes = *d.at(key + ".nodes").as_array();
        QueueProfile q{name, d.text(key + ".mode"), int(number_of(*nodes.get(0))), int(number_of(*nodes.get(1))),
                       d.number(key + ".minutes")};
        if (!q.mode.empty() && std::find(modes.begin(), modes.end(), q.mode) == modes.end())
            d.complain(key + ".mode",
                       fmt::format("expected the name of a mode, found \"{}\"{}", q.mode,
                                   modes.empty() ? fmt::format("; write [mode.{}]", q.mode)
                                                 : did_you_mean(q.mode, modes) + fmt::format(" Known: {}", fmt::join(modes, ", "))));
        if (q.least_nodes > q.most_nodes)
            d.complain(key + ".nodes", fmt::format("expected [fewest, most], found [{}, {}]; exchange them", q.least_nodes, q.most_nodes));
        m.queues.push_back(std::move(q));
    }
    const auto check_braces = [&](const std::string& key, const std::string& line) {
        for (auto at = line.find('{'); at != line.npos; at = line.find('{', at + 1)) {
            if (at > 0 && line[at - 1] == '$') continue; // the shell's
            const auto name = line.substr(at + 1, std::min(line.find('}', at), line.size()) - at - 1);
            if (name != "ranks" && name != "per_node" && name != "nodes" && name != "threads")
                d.complain(key, fmt::format("expected {{ranks}}, {{per_node}}, {{nodes}} or {{threads}} in braces, found {{{}}}; "
                                            "the shell's own need a $ before",
                                            name));
        }
    };
    check_braces("launch.command", m.launcher);
    for (const auto& line : m.directives) check_braces("launch.directives", line);
    for (const auto& line : m.setup) check_braces("launch.setup", line);
    for (const auto& mode : m.modes)
        for (const auto& line : mode.setup) check_braces("mode." + mode.name + ".setup", line);
    m.cost = {d.number("cost.pair_ns.double"),   d.number("cost.pair_ns.mixed"), d.number("cost.particle_ns"),
              d.number("cost.memory_bandwidth"), d.number("cost.latency"),       d.number("cost.bandwidth")};
    d.throw_if_any();
    return m;
}

MachineProfile read_machine_profile(const std::string& name_or_path, const std::vector<std::filesystem::path>& folders)
{
    if (name_or_path.find('/') != name_or_path.npos || name_or_path.ends_with(".toml"))
        return parse_machine_profile(read_document_text(name_or_path, machine_keys().file()), name_or_path, folders);
    std::vector<std::string> known, searched;
    std::error_code error;
    for (const auto& folder : folders) {
        const auto file = folder / (name_or_path + ".toml");
        if (std::filesystem::exists(file, error))
            return parse_machine_profile(read_document_text(file, machine_keys().file()), file, folders);
        searched.push_back(folder.string());
        for (const auto& entry : std::filesystem::directory_iterator(folder, error))
            if (entry.path().extension() == ".toml") known.push_back(entry.path().stem().string());
    }
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    throw BadInput(known.empty()
                       ? fmt::format("--machine {}: expected a machine profile, found none in {}; give the path of a .toml file",
                                     name_or_path, fmt::join(searched, ", "))
                       : fmt::format("--machine {}: expected a machine profile, found none of this name in {}{} Known: {}; or give the "
                                     "path of a .toml file",
                                     name_or_path, fmt::join(searched, ", "), did_you_mean(name_or_path, known), fmt::join(known, ", ")));
}

} // namespace kuzure::io
