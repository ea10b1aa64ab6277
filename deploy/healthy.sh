#!/bin/sh
# Whether the doctor has found a process well in the last 15 s: `healthy NAME`. It says what was
# found. Reading a file costs milliseconds; to ask the process itself would start Python each time.
found=$(find /health -name "$1" -newermt '-15 seconds' -exec cat {} +)
echo "${found:-the doctor has said nothing of $1 for 15 s}"
case $found in
    well*) ;;
    *) exit 1 ;;
esac
