// Loaded by trap_test.sh before the MPI library: at the end of its work the program divides by zero or fails otherwise, as
// KUZURE_TEST_DEFECT says, in the thread that called or in another.
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <thread>

extern "C" int PMPI_Finalize();
extern "C" int MPI_Finalize()
{
    const char* name = std::getenv("KUZURE_TEST_DEFECT");
    const std::string_view defect = name ? name : "";
    volatile double zero = 0, large = 1e300, result = 0;
    if (defect == "division") result = 1 / zero;
    if (defect == "invalid") result = zero / zero;
    if (defect == "overflow") result = large * large;
    if (defect == "thread") std::thread([&] { result = 1 / zero; }).join();
    return PMPI_Finalize();
}
