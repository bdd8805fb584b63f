// Any bytes are what hazard, fit and safety left in a directory, or a refusal in words. The first byte of the input chooses:
//   0  plan.json of a hazard; 1  fit_plan.json; 2  hazard.json; 3  summary.json of a member; 4  a trial's record; 5  plan.json of a safety.
#include "solver/app/hazard/kept.hpp"
#include "solver/app/safety/kept.hpp"
#include "tests/fuzz/fuzz.hpp"
#include <cmath>

using namespace kuzure;
using namespace kuzure::fuzz;

namespace {

void inspect(const hazard::KeptRuns& kept)
{
    if (!(kept.coarsest > 0) || kept.group < 0) found("an answer of no runs");
    for (const auto& r : kept.runs) {
        if (!(r.spacing > 0) || !(r.layers > 0) || r.member.number < 0 || r.member.values.size() != 1) found("a run that cannot be");
        const auto below = io::Path("here") / r.directory;
        if (*below.lexically_normal().begin() != "here" || r.directory.is_absolute()) found("a run elsewhere");
    }
}

void inspect(const safety::KeptTrial& t)
{
    if (t.seen.size() > safety::legs) found("more looks than legs");
    for (const auto& s : t.seen)
        if (!std::isfinite(s.time + s.displacement) || !std::isfinite(s.creep) || !std::isfinite(s.unbalanced)) found("a look at nothing");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    if (size == 0 || size > (1 << 20)) return 0;
    const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        // What is accepted is kept again, and reads back as it was.
        switch (data[0] % 6) {
        case 0: {
            const auto plan = hazard::plan_from_text(rest);
            if (!(hazard::plan_from_text(to_text(plan)) == plan)) found("a plan reads back as another");
            break;
        }
        case 1: {
            const auto plan = hazard::fit_from_text(rest);
            if (!(hazard::fit_from_text(to_text(plan)) == plan)) found("a fit's plan reads back as another");
            break;
        }
        case 2:
            inspect(hazard::runs_from_text(rest, {"friction"}));
            break;
        case 3:
            if (const auto end = hazard::end_from_text(rest); end && !(end->seconds >= 0)) found("a run of no time");
            break;
        case 4: {
            const auto trial = safety::trial_from_text(rest);
            inspect(trial);
            if (to_text(safety::trial_from_text(to_text(trial))) != to_text(trial)) found("a trial reads back as another");
            break;
        }
        default: {
            const auto of = safety::identity_from_text(rest);
            if (safety::identity_from_text(safety::plan_text(of)) != of) found("a question reads back as another");
        }
        }
    } catch (const std::runtime_error& e) {
        judge_refusal(e.what());
    }
    return 0;
}
