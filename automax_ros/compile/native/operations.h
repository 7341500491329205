/* Operations of Python that C has not, or has otherwise: each gives the bits that Python gives. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* core.numbers.REAL_MAX: the single-precision value next to the limit. */
#define REAL_MOST 0x1.fffffep+62

/* Kept from the compiler, which would compute some of them itself, and round otherwise than the C library. */
static double (*volatile const library_sin)(double) = sin;
static double (*volatile const library_cos)(double) = cos;
static double (*volatile const library_tan)(double) = tan;
static double (*volatile const library_atan)(double) = atan;
static double (*volatile const library_log)(double) = log;
static double (*volatile const library_exp)(double) = exp;
static double (*volatile const library_pow)(double, double) = pow;

/* The quotient of the integers, rounded down; the divisor is not 0. */
static inline int64_t floor_quotient(int64_t left, int64_t right) {
    int64_t quotient = left / right;
    return quotient - (left % right != 0 && (left < 0) != (right < 0));
}

/* What floor_quotient leaves: it has the sign of the divisor. */
static inline int64_t floor_remainder(int64_t left, int64_t right) {
    int64_t rest = left % right;
    return rest != 0 && (rest < 0) != (right < 0) ? rest + right : rest;
}

/* min(first, second) and max(first, second): of equal ones, and where one is not a number, the first. */
static inline int64_t least_of(int64_t first, int64_t second) { return second < first ? second : first; }
static inline int64_t most_of(int64_t first, int64_t second) { return second > first ? second : first; }
static inline __int128 least_wide(__int128 first, __int128 second) { return second < first ? second : first; }
static inline __int128 most_wide(__int128 first, __int128 second) { return second > first ? second : first; }
static inline double least_real(double first, double second) { return second < first ? second : first; }
static inline double most_real(double first, double second) { return second > first ? second : first; }

/* abs(value). */
static inline int64_t magnitude_of(int64_t value) { return value < 0 ? -value : value; }
static inline __int128 magnitude_wide(__int128 value) { return value < 0 ? -value : value; }

/* A value that no block leaves beyond its bounds; ranges alone do not show it. */
static inline int64_t held(int64_t value, int64_t low, int64_t high, int *ended) {
    if (value >= low && value <= high) return value;
    if (*ended == 0) *ended = AUTOMAX_FAULT;
    return low;
}

static inline int64_t held_wide(__int128 value, int64_t low, int64_t high, int *ended) {
    if (value >= low && value <= high) return (int64_t)value;
    if (*ended == 0) *ended = AUTOMAX_FAULT;
    return low;
}

/* A divisor; Python raises an exception where it is 0. */
static inline int64_t divisor(int64_t value, int *ended) {
    if (value != 0) return value;
    if (*ended == 0) *ended = AUTOMAX_FAULT;
    return 1;
}

/* The quotient of REALs; Python raises an exception where the divisor is 0. */
static inline double divided(double left, double right, int *ended) {
    if (right == 0.0 && *ended == 0) *ended = AUTOMAX_FAULT;
    return left / right;
}

/* The integer below, or toward 0; what is not a number, or does not fit, ends the scan. */
static inline int64_t floored(double value, int *ended) {
    if (!(fabs(value) < 9.2e18)) {
        if (*ended == 0) *ended = AUTOMAX_FAULT;
        return 0;
    }
    int64_t whole = (int64_t)value;
    return whole - (value < (double)whole);
}

static inline int64_t truncated(double value, int *ended) {
    if (!(fabs(value) < 9.2e18)) {
        if (*ended == 0) *ended = AUTOMAX_FAULT;
        return 0;
    }
    return (int64_t)value;
}

static inline __int128 floored_wide(double value, int *ended) {
    if (value >= -4e18 && value <= 4e18) return floored(value, ended);
    if (!(fabs(value) < 0x1p126) && *ended == 0) *ended = AUTOMAX_FAULT;
    return *ended ? 0 : (__int128)floor(value);
}

static inline __int128 truncated_wide(double value, int *ended) {
    if (value >= -4e18 && value <= 4e18) return truncated(value, ended);
    if (!(fabs(value) < 0x1p126) && *ended == 0) *ended = AUTOMAX_FAULT;
    return *ended ? 0 : (__int128)value;
}

/* core.numbers.stored_real: what a REAL variable holds, and whether it was clamped. */
static inline double stored_real(double value, bool *clamped) {
    const double most = REAL_MOST;
    *clamped = false;
    if (value != value) {
        *clamped = true;
        return 0.0;
    }
    if (value > most || value < -most) {
        *clamped = fabs(value) > 9.2233717e18;
        return value > 0.0 ? most : -most;
    }
    if (-2.7105054e-20 < value && value < 5.4210107e-20) return 0.0;
    return (double)(float)value;
}

/* functions.integer_power: in bounded steps, clamped to 32 bits. */
static inline int64_t integer_power(int64_t base, int64_t exponent, int64_t *problem) {
    *problem = 0;
    if (exponent < 0) {
        if (base == 0) {
            *problem = 7024;
            return INT32_MAX;
        }
        if (base != 1 && base != -1) return 0;
        return exponent % 2 == 0 ? 1 : base;
    }
    if (exponent == 0) return 1;
    if (base == 0 || base == 1) return base;
    if (base == -1) return exponent % 2 == 0 ? 1 : -1;
    int64_t most = base < 0 && exponent % 2 ? INT32_MIN : INT32_MAX;
    int64_t power = 1;
    if (exponent > 31) {
        *problem = 7023;
        return most;
    }
    for (int64_t step = 0; step < exponent; step++) {
        power *= base; /* less than 2 ** 63: both are within 32 bits */
        if (power > INT32_MAX || power < INT32_MIN) {
            if (power == INT32_MIN && step + 1 == exponent) return power;
            *problem = 7023;
            return most;
        }
    }
    return power;
}

/* functions.real_power. */
static inline double real_power(double base, double exponent, int64_t *problem) {
    const double most = REAL_MOST;
    *problem = 0;
    if (base == 0.0 && exponent < 0.0 && isfinite(exponent)) {
        *problem = 7024;
        return most;
    }
    if (isfinite(base) && isfinite(exponent)) {
        if (base < 0.0 && exponent != floor(exponent)) { /* Python gives a complex number, or overflows on the way */
            *problem = 7025;
            return 0.0;
        }
        double power = library_pow(base, exponent);
        if (isinf(power)) {
            *problem = 7023;
            return base < 0.0 && fmod(exponent, 2.0) != 0.0 ? -most : most;
        }
        return power;
    }
    return library_pow(base, exponent);
}

/* An argument of a function of the library, for which Python raises an exception outside of these bounds. */
static inline double within(double value, double low, double high, int *ended) {
    if ((value < low || value > high) && *ended == 0) *ended = AUTOMAX_FAULT;
    return value;
}

/* A power in the formula of a coefficient; Python raises an exception where it overflows. */
static inline double raised(double base, double exponent, int *ended) {
    double power = library_pow(base, exponent);
    if (isinf(power) && isfinite(base) && *ended == 0) *ended = AUTOMAX_FAULT;
    return power;
}
