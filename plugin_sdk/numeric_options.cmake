# What every file that computes is compiled with, here and out of this tree: the same source must give the same numbers in the
# kernel, in a plugin and in a test. No contraction, one instruction set for all.
set(GRAVITAS_NUMERIC_OPTIONS -march=x86-64-v3 -ffp-contract=off -fno-math-errno)
