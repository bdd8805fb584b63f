# shellcheck shell=bash
# Settings every script of kuzure needs; source it. Only what is unset is set, so a user's or a batch system's choice
# stands. Also gives KUZURE_CORES: the cores this process may use, container limits included.

# Open MPI: as root (else mpirun refuses), more ranks than cores (else "not enough slots"), no binding (else two threads
# share a core), yielding waits (else 8 ranks on 2 cores are 200 times slower), and no message copied through
# process_vm_readv, which containers forbid noisily.
: "${OMPI_ALLOW_RUN_AS_ROOT=1}"
: "${OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1}"
: "${OMPI_MCA_rmaps_base_oversubscribe=1}"
: "${OMPI_MCA_hwloc_base_binding_policy=none}"
: "${OMPI_MCA_mpi_yield_when_idle=1}"
: "${OMPI_MCA_btl_base_warn_component_unused=0}"
: "${OMPI_MCA_btl_vader_single_copy_mechanism=none}"
export OMPI_ALLOW_RUN_AS_ROOT OMPI_ALLOW_RUN_AS_ROOT_CONFIRM OMPI_MCA_rmaps_base_oversubscribe \
    OMPI_MCA_hwloc_base_binding_policy OMPI_MCA_mpi_yield_when_idle OMPI_MCA_btl_base_warn_component_unused \
    OMPI_MCA_btl_vader_single_copy_mechanism

# The cores of the affinity mask, or fewer where a control group grants less processor time than that.
kuzure_cores() {
    local cores quota period
    cores=$(nproc)
    if read -r quota period 2>/dev/null </sys/fs/cgroup/cpu.max && [ "$quota" != max ]; then :
    elif read -r quota 2>/dev/null </sys/fs/cgroup/cpu/cpu.cfs_quota_us && [ "$quota" -gt 0 ]; then
        read -r period </sys/fs/cgroup/cpu/cpu.cfs_period_us
    else
        echo "$cores"
        return
    fi
    quota=$(((quota + period - 1) / period))
    echo $((quota < cores ? quota : cores))
}
: "${KUZURE_CORES:=$(kuzure_cores)}"
export KUZURE_CORES
