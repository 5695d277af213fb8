#!/bin/sh
# The valve's integrator beside SUNDIALS CVODE: law, parameters, motion, error and cost in one table.
# Needs Debian's libsundials-dev and a C compiler.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
"${CC:-cc}" -O3 -Wall -Wextra -o "$out/cvode_lugre" "$here/peers/cvode_lugre.c" \
    -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixdense -lsundials_sunlinsoldense -lm
cd "$here/.."
cargo run --quiet --release -p valve-model --example integrator -- "$out/cvode_lugre"
