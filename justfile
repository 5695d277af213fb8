# The usual commands, one line each; `just` lists them. Each can be typed without just as well.

# List the recipes
default:
    @just --list --unsorted

# From nothing to a run in real time: install, build, simulate
demo *SCENARIO:
    tools/demo {{SCENARIO}}

# Every check and test, as CI runs them but for the ban on skipping
check *FLAGS:
    tools/check {{FLAGS}}

# Just what CI runs
ci:
    .ci/run

# Release programs, in target/release
build:
    cargo build --release --workspace --bins --locked

# Formatting
fmt:
    cargo fmt --all

# Lints, as strict as CI
lint:
    cargo clippy --workspace --all-targets --locked -- -D warnings

# A crate's tests, all or those whose name contains NAME
test CRATE *NAME:
    cargo test --package {{CRATE}} --locked -- {{NAME}}

# A file of black-box tests (tests/tests/FILE.rs), all or those whose name contains NAME
blackbox FILE *NAME:
    cargo build --workspace --bins --examples --locked && cargo test --workspace --locked --test {{FILE}} -- --nocapture {{NAME}}

# The documentation of the crates, in a browser
doc:
    cargo doc --workspace --no-deps --locked --open

# Run a scenario in real time; the run goes to OUT
simulate SCENARIO OUT:
    cargo build --release --locked --package stepvalve --package supervisor --package processes --bins && target/release/stepvalve simulate {{SCENARIO}} --out {{OUT}}

# Write docs/effects.md from the table of effects in the code
effects:
    STEPVALVE_WRITE_DOCS=1 cargo test --package valve-model --locked --test effects_document

# Fuzz the inputs (needs a nightly Rust)
fuzz *ARGUMENTS:
    tools/fuzz {{ARGUMENTS}}

# All processes under AddressSanitizer
sanitize:
    tools/sanitize
