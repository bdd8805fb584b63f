#pragma once
// What kuzure run was told.
#include "solver/app/cli/command.hpp"
#include "solver/app/run/status.hpp"
#include <optional>
#include <string>

namespace kuzure {

struct RunArguments {
    SceneArguments scene;
    std::string output;
    std::optional<std::string> restart; // empty: the newest good checkpoint
    int threads = 0;
    double max_minutes = 0;
    bool force = false, force_size = false, quiet = false, plain = false;
    int recut_every = 0;
    bool twins = false, check_only = false;
    Progress progress = Progress::Auto;
    // Of a twin: when the program it belongs to began (s), and the STOP file of the run it belongs to.
    std::optional<double> began;
    io::Path also_stop;
};

} // namespace kuzure
