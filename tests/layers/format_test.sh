#!/usr/bin/env bash
# Every C++ file that git keeps stands as .clang-format says, every Python file as black does by pyproject.toml. To mend:
#   git ls-files '*.hpp' '*.cpp' | xargs clang-format -i;  git ls-files '*.py' | xargs black
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
for tool in clang-format black; do
    command -v $tool >/dev/null || { echo "$tool is missing: jobs/install.sh tests installs it"; exit 1; }
done

ill_formatted() { # FILE... : those of them that are
    local file
    for file in "$@"; do
        case "$file" in *.py) ;; *) clang-format --dry-run -Werror "$file" 2>/dev/null || echo "$file" ;; esac
    done
    local python=()
    for file in "$@"; do
        case "$file" in *.py) python+=("$file") ;; esac
    done
    [ ${#python[@]} = 0 ] || { black --check "${python[@]}" 2>&1 || true; } | sed -n -e 's/^would reformat //p' -e 's/^error: cannot format \([^:]*\):.*/\1/p'
}

# The check must be able to fail, and to pass.
planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
cp .clang-format pyproject.toml "$planted"
printf 'int  f( ){return 1;}\n' >"$planted/bad.cpp"
printf 'int f() { return 1; }\n' >"$planted/good.cpp"
printf "a = 'one'\n" >"$planted/bad.py"
printf 'a = f("%0100d")\n' 0 >"$planted/good.py" # wider than black is by itself: pyproject.toml is read
printf 'a = f(\n    "%0100d"\n)\n' 0 >"$planted/bad_width.py"
found=$(cd "$planted" && ill_formatted bad.cpp bad.py bad_width.py good.cpp good.py | sort | tr '\n' ' ')
[ "$found" = "bad.cpp bad.py bad_width.py " ] || { echo "self-check: the ill-formatted files found are: $found"; exit 1; }

if git rev-parse --git-dir >/dev/null 2>&1; then
    mapfile -d '' files < <(git ls-files -z '*.hpp' '*.cpp' '*.py')
else
    mapfile -d '' files < <(find solver decomposition io perf python tests jobs docs \( -name '*.hpp' -o -name '*.cpp' -o -name '*.py' \) -print0)
fi
[ ${#files[@]} -gt 0 ] || { echo "no files found"; exit 1; }
kept=()
for file in "${files[@]}"; do
    [ ! -f "$file" ] || kept+=("$file")
done
mapfile -t bad < <(ill_formatted "${kept[@]}")
if [ ${#bad[@]} -gt 0 ]; then
    echo "not as .clang-format or black says, mend by clang-format -i or black: ${bad[*]}"
    exit 1
fi
echo "${#files[@]} files stand as .clang-format ($(clang-format --version | sed 's/.*version //')) and $(black --version | head -1) say"
