// The kuzure of a package: starts the program built for the best instruction set this processor has, out of
// ../lib/kuzure/<instruction set>/kuzure. KUZURE_ISA=x86-64 | x86-64-v3 | x86-64-v4 (on Arm: aarch64 | sve-256 | sve-512) chooses another.
// Built for any processor of its architecture.
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <unistd.h>
#include <vector>
#if defined(__aarch64__)
#include <sys/auxv.h>
#include <sys/prctl.h>
#endif

namespace {

struct Isa {
    const char* name;
    bool here; // this processor can run it
};

#if defined(__x86_64__)
std::vector<Isa> best_first()
{
    __builtin_cpu_init();
    return {
        {"x86-64-v4", __builtin_cpu_supports("x86-64-v4") != 0}, {"x86-64-v3", __builtin_cpu_supports("x86-64-v3") != 0}, {"x86-64", true}};
}
#elif defined(__aarch64__)
std::vector<Isa> best_first()
{
    // A program for SVE is compiled for one length of its registers, which the system says by the thread.
    const bool has_sve = (getauxval(AT_HWCAP) & HWCAP_SVE) != 0;
    const int bytes = has_sve ? prctl(PR_SVE_GET_VL) & PR_SVE_VL_LEN_MASK : 0;
    return {{"sve-512", bytes == 64}, {"sve-256", bytes == 32}, {"aarch64", true}};
}
#else
#error "the launcher does not know the instruction sets of this architecture: build without KUZURE_ISA"
#endif

int wrong(const std::string& what)
{
    std::fprintf(stderr, "kuzure: %s\n", what.c_str());
    return 2;
}

} // namespace

int main(int, char** argv)
{
    const std::vector<Isa> all = best_first();
    char self[PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self);
    if (n <= 0 || n == ssize_t(sizeof self)) return wrong("/proc/self/exe cannot be read, so the program is not found");
    std::string folder(self, std::size_t(n));
    for (int up = 0; up < 2; ++up) folder.resize(folder.rfind('/'));
    folder += "/lib/kuzure/";

    const char* asked = std::getenv("KUZURE_ISA");
    if (asked && !*asked) asked = nullptr;
    std::string known;
    for (const Isa& isa : all) {
        known += std::string(known.empty() ? "" : ", ") + isa.name;
        if (asked ? std::strcmp(asked, isa.name) != 0 : !isa.here) continue;
        if (!isa.here) return wrong(std::string("KUZURE_ISA=") + asked + ": this processor does not have these instructions; unset it");
        const std::string program = folder + isa.name + "/kuzure";
        execv(program.c_str(), argv);
        // Not in this package: the next best, unless it was asked for.
        if (asked || errno != ENOENT) return wrong(program + ": " + std::strerror(errno));
    }
    if (asked) return wrong(std::string("KUZURE_ISA=") + asked + ": expected one of " + known);
    return wrong("no program under " + folder + "; install the package again");
}
