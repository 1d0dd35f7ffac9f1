# Sourced by quickstart.sh and tests/run.sh: installs the Debian packages that are missing, and says which.
# Touches nothing but packages; uses sudo only where the user is not root.

morph_packages="build-essential cmake ninja-build pkg-config coinor-libipopt-dev libfcl-dev libopenblas-dev \
liblapacke-dev libassimp-dev libyaml-dev libcairo2-dev libhdf5-dev libcjson-dev libsuitesparse-dev libnlopt-dev"

# install_missing PACKAGE...
install_missing() {
    missing=""
    for package in "$@"; do
        case "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" in
        installed) ;;
        *) missing="$missing $package" ;;
        esac
    done
    if [ -z "$missing" ]; then
        return 0
    fi
    echo "Installing from Debian:$missing"
    root=""
    if [ "$(id -u)" -ne 0 ]; then
        root="sudo"
    fi
    # Without a terminal of its own for dpkg: a bare root may have none to give. The environment is set behind sudo, which
    # would drop it.
    $root apt-get update -qq
    # shellcheck disable=SC2086 # a list of names, one word each
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends -o Dpkg::Use-Pty=0 $missing >/dev/null
}
