#pragma once
// kuzure hazard: a preliminary run, an ensemble and finer runs until a deadline, each a child `kuzure run` in a directory of its own; what
// is finished is not run again.
#include "solver/app/cli/command.hpp"
#include "solver/app/hazard/answer.hpp"

namespace kuzure::hazard {

/// What kuzure hazard was told.
struct Arguments {
    SceneArguments scene;
    std::string output, within, layers, members_from;
    int members = 0, jobs = 0;
    bool prepare = false; // write the scenes of all runs, for others to run
};
/// Throws BadInput, IoFailed.
Exit run_hazard(const Comm&, const Arguments&);

/// --members-from: the answer of the runs that a hazard.json lists, into `out`; runs nothing. Throws BadInput, IoFailed.
Exit answer_again(Base, const Arguments&, const std::vector<io::NamedPoint>&, const io::Path& out);

/// Where an answer stands.
struct State {
    const Base& base;
    std::string scene_file;
    const std::vector<Run>& runs;
    double deadline = 0, ended = 0; // s; a deadline of 0: none
    int group = 0;                  // members drawn together
    bool final = false;
    std::vector<Words> not_done, not_modelled;
};
nlohmann::ordered_json to_json(const State&, const Answer&);
/// What was meant to be done and was not, in words. Members from `extra_from` on (0: none) were only to fill the time; `no_finer`: why
/// there was no finer run.
std::vector<Words> not_done(const std::vector<Run>&, int extra_from, bool varied, const Words& no_finer);
/// What no run of this scene has in it, in words.
std::vector<Words> not_modelled(const Base&);

} // namespace kuzure::hazard
