#pragma once
// The runs of an answer, each a child `kuzure run` in a directory of its own, some at a time; what is finished is not run again, what was
// begun goes on from its checkpoint.
#include "solver/app/hazard/answer.hpp"
#include "solver/app/study/child.hpp"
#include "solver/app/study/runs.hpp"
#include <deque>
#include <functional>

namespace kuzure::hazard {

using study::say, study::seconds_text;

class Queue {
public:
    /// `left`: seconds to the deadline. `stopped`: whether a signal came. `after_each`: when a run has ended.
    /// Needs a living study::StopRequest.
    Queue(const Base& base, io::Path directory, double within, std::function<double()> left, std::function<bool()> stopped,
          std::function<void()> after_each)
        : base_(base), out_(std::move(directory)), within_(within), left_(std::move(left)), stopped_(std::move(stopped)),
          after_each_(std::move(after_each))
    {
    }
    std::deque<Run> runs; // they are pointed at

    Run& add(Part, Member, double spacing, const std::string& name);
    /// Writes a run's scene and starts nothing; what kuzure run is told for it, as words of a shell. Throws BadInput, IoFailed.
    std::string prepare_only(Run&) const;
    /// Runs what fits before the deadline, in order. `expected`: s each, until the first has ended.
    void work(std::vector<Run*> todo, int jobs, int threads, double expected);

private:
    struct Running {
        study::Child child;
        Run* run;
        double began; // s of wall_clock()
    };
    bool over() const { return left_() <= 0 || stopped_(); }
    bool prepare(Run&, RunScene&) const;
    std::vector<std::string> words_of(const Run&, const RunScene&) const;
    void take_what_is_there(Run&) const;
    void finish(Run&) const;
    std::optional<Running> start(Run&, int threads) const;
    void conclude(Run&, const study::ChildResult&) const;

    const Base& base_;
    io::Path out_;
    double within_;
    std::function<double()> left_;
    std::function<bool()> stopped_;
    std::function<void()> after_each_;
};

} // namespace kuzure::hazard
