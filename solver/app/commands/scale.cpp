// kuzure scale: the real cut of the real scene for any number of ranks, counted on one machine.
#include "io/checkpoint.hpp"
#include "solver/app/command.hpp"
#include "solver/app/scaling.hpp"
#include "solver/app/simulation.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kuzure {

void add_scale(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("scale", "the real cut of the scene for any number of ranks, on one machine; runs nothing");
    auto args = std::make_shared<SceneArguments>();
    auto ranks = std::make_shared<std::vector<int>>();
    args->add_to(*command);
    command->add_option("--ranks", *ranks, "numbers of ranks")->required()->delimiter(',')->check(CLI::Range(1, 1 << 20));
    command->callback([=, &chosen] {
        chosen = [=](const Comm& comm) {
            const Scene s = args->read(comm);
            const scene::Filling filling(s);
            for (const int n : *ranks) {
                const BlockSpace space = block_space(s, filling, n);
                const CutShare c = share_out(StartSoil(s, filling, space), n, list_reach(s), 128);
                fmt::print("{:>6} ranks {:>8} blocks  pairs {:.4f} work {:.4f} halo {:.3f} scattered {} weigh {:.2f} s cut {:.2f} s\n", n, c.blocks,
                           c.pair_balance(), c.balance(), c.ghost_share(), c.scattered, c.weigh_seconds, c.cut_seconds);
            }
            return Exit::Ok;
        };
    });
}

} // namespace kuzure
