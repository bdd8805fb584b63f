#!/usr/bin/env bash
# A real Slurm on virtual nodes of this host (vcluster.sh), without systemd: for tests. Root only.
#   slurm.sh up [NODES [CPUS]]   prints the line that makes Slurm's commands find it: export SLURM_CONF=...
#   slurm.sh down                ends it and takes the nodes away
# The controller is node "ctl" in a mount and UTS namespace of its own; every slurmd lives in its node's namespaces, with its
# own /dev/shm, or ranks of different nodes would meet there. CPUs may be more than there are.
set -euo pipefail
here=$(realpath "$(dirname "$0")")
name=${KUZURE_CLUSTER:-kz}
export KUZURE_CLUSTER=$name
state=${KUZURE_CLUSTER_DIR:-/tmp/kuzure-cluster-$name}
slurm=$state/slurm
for tool in slurmctld slurmd munged; do
    command -v $tool >/dev/null || [ -x /usr/sbin/$tool ] || { echo "slurm.sh: no $tool; jobs/install.sh cluster" >&2; exit 77; }
done
PATH=$PATH:/usr/sbin

end() { # a daemon by the file that holds its process id
    local pid
    pid=$(cat "$1" 2>/dev/null) || return 0
    kill -9 "$pid" 2>/dev/null || true
    for _ in $(seq 50); do
        kill -0 "$pid" 2>/dev/null || return 0
        sleep 0.1
    done
}

case ${1-} in
up)
    n=${2:-2} cpus=${3:-2}
    bash "$here/vcluster.sh" up "$n"
    mkdir -p "$slurm"/{state,log,spool,run,tmp}
    net=$(awk '$2 == "node1" {print $1; exit}' "$state/hosts")
    net=${net%.*}
    memory=$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)
    # munge of our own, with a key and a socket of our own: the host's is left alone.
    if [ ! -s "$slurm/munge.key" ]; then
        (umask 077; head -c 1024 /dev/urandom >"$slurm/munge.key")
        chmod 711 "$state" "$slurm" "$slurm/run"
    fi
    munged --force --key-file="$slurm/munge.key" --socket="$slurm/run/munge" --pid-file="$slurm/run/munged.pid" \
        --log-file="$slurm/log/munged.log" --seed-file="$slurm/run/munged.seed" 2>/dev/null
    {
        cat <<CONF
ClusterName=$name
SlurmctldHost=ctl($net.254)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$slurm/run/munge,cred_expire=5
CredType=cred/munge
SlurmctldPidFile=$slurm/run/slurmctld.pid
SlurmdPidFile=$slurm/run/slurmd-%n.pid
SlurmctldLogFile=$slurm/log/slurmctld.log
SlurmdLogFile=$slurm/log/slurmd-%n.log
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool/%n
TmpFS=$slurm/tmp/%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=pmix
ReturnToService=2
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2,bf_interval=2,sched_min_interval=0
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/linux
KillWait=5
CONF
        for k in $(seq "$n"); do
            echo "NodeName=node$k NodeAddr=$net.$k CPUs=$cpus RealMemory=$memory State=UNKNOWN"
        done
        echo "PartitionName=debug Nodes=ALL Default=YES MaxTime=1440 State=UP"
    } >"$slurm/slurm.conf"
    export SLURM_CONF=$slurm/slurm.conf
    unshare --mount --uts bash -c 'hostname ctl; mount --make-rprivate /; mount --bind "$1" /etc/hosts; exec slurmctld -f "$2"' \
        _ "$state/hosts" "$SLURM_CONF"
    for k in $(seq "$n"); do
        mkdir -p "$slurm/spool/node$k" "$slurm/tmp/node$k"
        bash "$here/vcluster.sh" on "$k" slurmd -f "$SLURM_CONF" -N "node$k"
    done
    for _ in $(seq 60); do
        [ "$(sinfo -h -N -o %T 2>/dev/null | grep -c idle)" = "$n" ] && break
        sleep 0.5
    done
    [ "$(sinfo -h -N -o %T | grep -c idle)" = "$n" ] || { echo "slurm.sh: not all nodes came up; logs in $slurm/log" >&2; exit 1; }
    echo "export SLURM_CONF=$SLURM_CONF"
    ;;
down)
    for pid in "$slurm"/run/slurmd-*.pid "$slurm/run/slurmctld.pid" "$slurm/run/munged.pid"; do
        end "$pid"
    done
    bash "$here/vcluster.sh" down
    ;;
*)
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac
