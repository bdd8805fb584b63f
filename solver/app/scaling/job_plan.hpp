#pragma once
// What a job on a machine asks for: nodes, queue, mode and time, from the scene's estimate and the machine's profile.
#include "solver/app/cli/command.hpp"
#include "solver/app/scaling/predict.hpp"

namespace kuzure {

/// What kuzure job was told.
struct JobArguments {
    SceneArguments scene;
    std::string machine, mode, queue, account, output;
    int nodes = 1, ranks_per_node = 0;
    double minutes = 0;
    int members = 0;    // of a hazard; 0 with `layers`: what the scene says
    std::string layers; // of its runs
    bool hazard() const { return members > 0 || !layers.empty(); }
};

/// What the script asks for and why.
struct JobPlan {
    io::MachineProfile machine;
    const io::ModeProfile* mode = nullptr;
    const io::QueueProfile* queue = nullptr;
    int nodes, per_node, ranks, threads;
    Estimate estimate;
    double predicted; // s of the whole run
    double memory;    // bytes a node
    int limit = 0;    // s of one job; 0: none
    int margin = 0;   // s kept at its end
    int jobs = 1;     // how many the run will probably take
    io::Path program, scene, results;
    std::string name;
    int members = 0;    // of a hazard, whose runs are the tasks of an array; 0: one run
    std::string layers; // of its runs
    bool clocked() const { return limit > 0; }
};

/// Of one run, or of a hazard's where the arguments say so. Collective. Throws BadInput for what the machine does not have.
JobPlan plan_job(const Comm&, const JobArguments&);

} // namespace kuzure
