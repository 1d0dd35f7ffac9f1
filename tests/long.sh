#!/bin/sh
# As run.sh, with the tests that it leaves out because they take long: some twenty minutes on two cores.
set -eu
export MORPH_LONG=ON
exec sh "$(dirname "$0")/run.sh"
