#pragma once
// A machine as a batch system and the performance model see it: jobs/machines/NAME.toml.
#include "io/keys.hpp"
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kuzure::io {

/// How a run goes on after its clock limit: the job submits itself again, or a chain of jobs is submitted at once, for
/// machines whose compute nodes cannot submit.
enum class Resubmit { Itself, Chain };

/// One node.
struct NodeProfile {
    int count;            // nodes of the machine
    int cores;            // cores that ranks and threads may use; 0: those of this host
    int threads_per_core; // threads kuzure starts on each
    int ranks;            // ranks kuzure starts on a node unless told otherwise
    double memory;        // bytes that ranks may use; 0: those of this host
};

/// A way in which a node's memory can be set up, such as KNL's flat and cache mode.
struct ModeProfile {
    std::string name, wrapper; // wrapper stands before the program: "numactl --preferred=1"
    std::optional<double> memory;
    std::vector<std::string> setup;
};

struct QueueProfile {
    std::string name;
    std::string mode; // empty: any
    int least_nodes, most_nodes;
    double minutes; // longest job
};

/// Constants of the performance model; each has its source beside it in the file.
struct CostProfile {
    double pair_ns_double, pair_ns_mixed; // ns of one core for a directed pair, update included
    double particle_ns;                   // ns of one core for a soil particle and step: lists, sorting, records
    double memory_bandwidth;              // bytes/s of a node
    double latency;                       // s of a short message between nodes
    double bandwidth;                     // bytes/s into or out of a node
    double pair_ns(bool mixed) const { return mixed ? pair_ns_mixed : pair_ns_double; }
};

struct MachineProfile {
    std::string name; // the file's, without .toml
    std::filesystem::path file;
    std::string title;
    std::string batch;                          // "none", or the system whose template BATCH.job.sh makes its scripts
    std::vector<std::filesystem::path> folders; // where templates and their parts are: beside the profile, then the known ones
    Resubmit resubmit;
    bool needs_account;
    NodeProfile node;
    std::string launcher;                // {ranks}, {per_node}, {nodes}, {threads} stand for the job's numbers
    std::vector<std::string> directives; // further lines of the batch header, the same braces
    std::vector<std::string> setup;      // shell lines before the launch, the same braces
    std::vector<ModeProfile> modes;      // the first is the default
    std::vector<QueueProfile> queues;    // the first that fits is taken
    CostProfile cost;

    int threads(int ranks_per_node) const { return std::max(1, node.cores * node.threads_per_core / ranks_per_node); }
};

/// The keys of a machine profile.
const KeyTable& machine_keys();

/// A profile from text; `file` is what messages call it; beside it, and then in the folders, are the templates of batch systems. Throws
/// BadInput with lines `file:line: key: expected, found, remedy`.
MachineProfile parse_machine_profile(std::string_view text, const std::filesystem::path& file,
                                     const std::vector<std::filesystem::path>& folders);

/// A profile by path (with a slash or .toml), or by name from the folders, in their order. Throws BadInput that lists the names there are.
MachineProfile read_machine_profile(const std::string& name_or_path, const std::vector<std::filesystem::path>& folders);

} // namespace kuzure::io
