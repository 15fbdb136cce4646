#!/bin/sh
# usage: fuzz/run.sh TARGET SECONDS
# Builds the targets with coverage for libFuzzer and runs one of them, as cargo-fuzz does; needs a nightly compiler.
set -eu
cd "$(dirname "$0")"
target=$1 seconds=$2
flags='-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4'
flags="$flags -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table"
flags="$flags -Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing -Ccodegen-units=16"
# With a target, build scripts and macros are built without coverage.
host=$(rustc +nightly -vV | sed -n 's/^host: //p')
RUSTFLAGS=$flags cargo +nightly build --release --target "$host" --bin "$target"
mkdir -p "work/$target" "finds/$target"
exec "target/$host/release/$target" "work/$target" "corpus/$target" \
    -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=10 -artifact_prefix="finds/$target/"
