#!/usr/bin/env bash
# Every C++ file that git keeps stands as .clang-format says. To mend: git ls-files '*.hpp' '*.cpp' | xargs clang-format -i
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
command -v clang-format >/dev/null || { echo "clang-format is missing: jobs/install.sh tests installs it"; exit 1; }

# The check must be able to fail, and to pass.
planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
cp .clang-format "$planted"
printf 'int  f( ){return 1;}\n' >"$planted/bad.cpp"
printf 'int f() { return 1; }\n' >"$planted/good.cpp"
if clang-format --dry-run -Werror "$planted/bad.cpp" 2>/dev/null; then
    echo "self-check: an ill-formatted file was not found"
    exit 1
fi
clang-format --dry-run -Werror "$planted/good.cpp" || { echo "self-check: a well-formatted file was refused"; exit 1; }

if git rev-parse --git-dir >/dev/null 2>&1; then
    mapfile -d '' files < <(git ls-files -z '*.hpp' '*.cpp')
else
    mapfile -d '' files < <(find solver decomposition io perf tests \( -name '*.hpp' -o -name '*.cpp' \) -print0)
fi
[ ${#files[@]} -gt 0 ] || { echo "no C++ files found"; exit 1; }
bad=()
for file in "${files[@]}"; do
    [ ! -f "$file" ] || clang-format --dry-run -Werror "$file" 2>/dev/null || bad+=("$file")
done
if [ ${#bad[@]} -gt 0 ]; then
    echo "not as .clang-format says, mend by: clang-format -i ${bad[*]}"
    exit 1
fi
echo "${#files[@]} files stand as .clang-format says ($(clang-format --version | sed 's/.*version //'))"
