/* The engine at one level of the processor: compiled once for each, with a name of its own (ISIW_LEVEL). */

#include "answers.h"
#include "engine.h"

static int elementary(int32_t number, int64_t count, const float *x, const float *y, float *found) {
    for (int64_t i = 0; i < count; i += LANES) {
        Reals some = loaded(x + i, count - i), result;
        switch (number) {
        case 0: result = exp_v(some); break;
        case 1: result = exp2_v(some); break;
        case 2: result = log_v(some); break;
        case 3: result = per_v(some); break;
        case 4: result = per_root_v(some); break;
        default: result = normal_between(some, loaded(y + i, count - i)); break;
        }
        stored(result, found + i, count - i);
    }
    return 0;
}

#define JOINED(a, b) a##b
#define NAMED(level) JOINED(isiw_engine_, level)

const Engine *NAMED(ISIW_LEVEL)(void);

const Engine *NAMED(ISIW_LEVEL)(void) {
    static const Engine engine = {
        .likelihoods = likelihoods,
        .meanings = meanings,
        .usual_weights = usual_weights,
        .learn = learn,
        .represent = represent,
        .draws = draws,
        .sweeps = sweeps,
        .evoked_means = evoked_means,
        .outcome_tables = outcome_tables,
        .rows_between = rows_between,
        .facilitations = facilitations,
        .edge_levels = edge_levels,
        .window_runs = window_runs,
        .best_window = best_window,
        .reductions = reductions,
        .ask = ask,
        .estimate = estimate,
        .elementary = elementary,
    };
    fill_nodes();
    return &engine;
}
