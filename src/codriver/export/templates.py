"""The files beside the step: check program, Makefile, README."""

from __future__ import annotations

from codriver.observers.observer import Observer


def check_source(name: str, real: str, golden: dict[str, str], tolerance: float) -> str:
    """A program that runs the golden vectors and returns 0 if the step answers as it must."""
    if real == "double":
        compare = """/* Bit for bit; a NaN equals a NaN. */
static int same(double got, double want)
{
    return memcmp(&got, &want, sizeof got) == 0 || (got != got && want != want);
}"""
    else:
        compare = f"""/* Single precision: off by at most {tolerance:g} of the larger of 1 and the value; a NaN equals a NaN. */
static int same(double got, double want)
{{
    const double scale = fabs(want) > 1.0 ? fabs(want) : 1.0;
    return got == want || fabs(got - want) <= {tolerance!r} * scale || (got != got && want != want);
}}"""
    return f"""/* Runs {name} over golden vectors. Returns 0 and prints "ok" if every output is right. */
#include "{name}.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define WIDTH {golden["width"]}

static const char *const names[WIDTH] = {{ {golden["names"]} }};

static const {name}_input inputs[] = {{
{golden["inputs"]}
}};

static const double wanted[][WIDTH] = {{
{golden["outputs"]}
}};

{compare}

int main(void)
{{
    const int rows = (int)(sizeof inputs / sizeof inputs[0]);
    {name}_state state;
    {name}_output output;
    double worst = 0.0;
    int wrong = 0;

    {name}_start(&state);
    for (int k = 0; k < rows; ++k) {{
        {name}_real got[WIDTH];
        {name}_step(&state, &inputs[k], &output);
        memcpy(got, &output, sizeof got);
        for (int i = 0; i < WIDTH; ++i) {{
            const double scale = fabs(wanted[k][i]) > 1.0 ? fabs(wanted[k][i]) : 1.0;
            const double error = fabs((double)got[i] - wanted[k][i]) / scale;
            worst = error > worst ? error : worst;
            if (!same((double)got[i], wanted[k][i])) {{
                if (wrong < 10)
                    printf("row %d, %s: got %a, want %a\\n", k, names[i], (double)got[i], wanted[k][i]);
                ++wrong;
            }}
        }}
    }}
    printf("%s: %d rows of %d outputs, %d wrong, worst error %.3g\\n", wrong ? "FAILED" : "ok", rows, WIDTH, wrong, worst);
    return wrong != 0;
}}
"""


def makefile(name: str) -> str:
    """`make check` compiles and runs the golden vectors."""
    return f"""CC ?= cc
CFLAGS ?= -O2
# Without these the compiler may fuse operations, and the results differ in their last bits.
EXACT = -std=c99 -ffp-contract=off -fno-fast-math $(EXACT_EXTRA)

check: {name}_check
\t./{name}_check

{name}_check: {name}.c {name}_check.c {name}.h
\t$(CC) $(CFLAGS) $(EXACT) -Wall -Wextra -o $@ {name}.c {name}_check.c -lm

clean:
\trm -f {name}_check

.PHONY: check clean
"""


def readme(observer: Observer, name: str, real: str, operations: int, tolerance: float) -> str:
    """What the files are and how to use them."""
    settings = "\n".join(f"* {key}: {value}" for key, value in observer.settings.items())
    claims = "\n".join(f"* {claim}" for claim in observer.certificate.claims) if observer.certificate else "* none"
    measured = ", ".join(observer.measured) or "none"
    held = ", ".join(observer.inputs)
    promise = (
        "bit for bit those of codriver"
        if real == "double"
        else f"within {tolerance:g} of codriver's, relative to max(1, |value|)"
    )
    return f"""# {observer.name} in C99

One step every {observer.dt:g} s; {operations} operations a step; numbers are `{real}`. No heap, no recursion, no global state.
Units are SI, axes ISO 8855 (x forward); angles in radians, pedal 0 to 1, pressure in Pa.

## Settings

{settings}

## What is proven of the design

{claims}

## Use

```c
{name}_state state;
{name}_input in;
{name}_output out;

{name}_start(&state);
for (;;) {{                     /* every {observer.dt:g} s */
    in.… = …;                   /* the newest value of each signal */
    in.…_ok = …;
    {name}_step(&state, &in, &out);
}}
```

`_ok` flags: for measurements ({measured}) true only on the step after a value arrived, so that a value is used once; for
inputs ({held}) true while the last value may be held. A value whose flag is false is not looked at.

## Check

    make check

compiles and runs `{name}_check.c` over golden vectors; the outputs must be {promise}. Compile with `-ffp-contract=off`
(the Makefile does); gcc 12 on a target with FMA also needs `-fno-tree-slp-vectorize` (`make check EXACT_EXTRA=...`).
"""
