#!/usr/bin/env bash
# Virtual nodes node1 ... nodeN on one host: network namespaces on a bridge, each with its own host name and /dev/shm, so that
# ranks of different nodes talk TCP and cannot share memory. For mpirun without ssh; root only (needs iproute2, util-linux).
#   vcluster.sh up N                      make N nodes
#   vcluster.sh run N PER_NODE PROGRAM..  mpirun of PER_NODE ranks on each of N nodes
#   vcluster.sh on K PROGRAM..            a command inside node K
#   vcluster.sh down                      take them away
# KUZURE_CLUSTER (default kz, a few letters) names bridge, network and folder; clusters of different names do not meet.
set -euo pipefail
name=${KUZURE_CLUSTER:-kz}
state=${KUZURE_CLUSTER_DIR:-/tmp/kuzure-cluster-$name}
net=10.77.$(($(cksum <<<"$name" | cut -d" " -f1) % 250))
usage() {
    sed -n '2,8s/^# \{0,1\}//p' "$0" >&2
    exit 2
}
[ "$(id -u)" = 0 ] || { echo "vcluster.sh: network namespaces need root" >&2; exit 77; }
command -v ip >/dev/null || { echo "vcluster.sh: no ip; install iproute2 (jobs/install.sh cluster)" >&2; exit 77; }

# node K PROGRAM..: in its network, with its host name, hosts file and shared memory
on_node() {
    local k=$1
    shift
    exec nsenter --net="/run/netns/$name$k" unshare --mount --uts bash -c '
        hostname "$1"; mount --make-rprivate /; mount -t tmpfs -o size=2g shm /dev/shm; mount --bind "$2" /etc/hosts
        shift 2; exec "$@"' _ "node$k" "$state/hosts" "$@"
}

case ${1-} in
up)
    n=${2:?how many nodes}
    mkdir -p "$state"
    ip link add "br-$name" type bridge 2>/dev/null || true
    ip addr replace $net.254/24 dev "br-$name"
    ip link set "br-$name" up
    {
        cat /etc/hosts
        echo "$net.254 ctl"
        for k in $(seq "$n"); do echo "$net.$k node$k"; done
    } >"$state/hosts"
    for k in $(seq "$n"); do
        ip netns add "$name$k" 2>/dev/null || true
        ip link show "${name}v$k" &>/dev/null || ip link add "${name}v$k" type veth peer name eth0 netns "$name$k"
        ip link set "${name}v$k" master "br-$name" up
        ip -n "$name$k" addr replace "$net.$k/24" dev eth0
        ip -n "$name$k" link set eth0 up
        ip -n "$name$k" link set lo up
    done
    # What mpirun takes for ssh: options, the node's name, a command line.
    cat >"$state/remote" <<REMOTE
#!/usr/bin/env bash
while [[ \${1-} == -* ]]; do shift; done
node=\$1
shift
KUZURE_CLUSTER=$name KUZURE_CLUSTER_DIR=$state exec bash "$(realpath "$0")" on "\${node#node}" bash -c "\$*"
REMOTE
    chmod +x "$state/remote"
    ;;
run)
    [ $# -ge 4 ] || usage
    n=$2 each=$3
    shift 3
    hosts=$(for k in $(seq "$n"); do printf 'node%d:%d,' "$k" "$each"; done)
    source "$(dirname "$0")/../../jobs/environment.sh"
    # mpirun itself stays outside, but must know the nodes' names.
    exec unshare --mount bash -c 'mount --make-rprivate /; mount --bind "$1" /etc/hosts; shift; exec "$@"' _ "$state/hosts" \
        mpirun --mca plm_rsh_agent "$state/remote" --mca plm_rsh_no_tree_spawn 1 --mca oob_tcp_if_include $net.0/24 \
        --mca btl_tcp_if_include $net.0/24 --host "${hosts%,}" -n $((n * each)) "$@"
    ;;
on)
    [ $# -ge 3 ] || usage
    shift
    on_node "$@"
    ;;
down)
    for space in $(ip netns list | awk -v n="$name" '$1 ~ "^" n "[0-9]+$" {print $1}'); do
        ip netns del "$space"
    done
    ip link del "br-$name" 2>/dev/null || true
    rm -rf "$state"
    ;;
*) usage ;;
esac
