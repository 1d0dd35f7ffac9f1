/* Ipopt's C interface as this project uses it, the same source for 3.11 (headers in coin/) and 3.14
 * (coin-or/).
 *
 * What differs: 3.11 says Number, Index and an int Bool; 3.14 says ipnumber, ipindex and bool, and marks the
 * old names deprecated. Plain double and int stand for the first two, asserted below; only Bool, which both
 * generations declare without a warning, is taken from the header. No option, function or return code that
 * one of them lacks is named in code: codes are compared as numbers. */
#ifndef MORPH_IPOPT_SHIM_H
#define MORPH_IPOPT_SHIM_H

#include <assert.h>
#include <stdbool.h>

/* pkg-config normally names the folder itself; the folders are tried for compilers called without it. */
#if __has_include(<IpStdCInterface.h>)
#include <IpStdCInterface.h>
#elif __has_include(<coin-or/IpStdCInterface.h>)
#include <coin-or/IpStdCInterface.h>
#elif __has_include(<coin/IpStdCInterface.h>)
#include <coin/IpStdCInterface.h>
#else
#error "Ipopt's IpStdCInterface.h was found neither by pkg-config's folder nor in coin-or/ or coin/"
#endif

/* int in 3.11, bool in 3.14: the callbacks below are declared with it. */
typedef Bool morph_ip_bool;

static_assert(_Generic((morph_ip_bool)0, int : 1, bool : 1, default : 0), "Ipopt's Bool is int or bool");

/* The callback types pin numbers to double and indices to int: an Ipopt built with single precision or 64-bit
 * indices stops here, at compile time, and not in a crash. */
static_assert(_Generic((Eval_F_CB)0, morph_ip_bool (*)(int, double *, morph_ip_bool, double *, void *) : 1,
                       default : 0),
              "Ipopt must use double numbers and int indices (objective)");
static_assert(_Generic((Eval_G_CB)0,
                       morph_ip_bool (*)(int, double *, morph_ip_bool, int, double *, void *) : 1,
                       default : 0),
              "Ipopt must use double numbers and int indices (rows)");
static_assert(_Generic((Eval_Jac_G_CB)0,
                       morph_ip_bool (*)(int, double *, morph_ip_bool, int, int, int *, int *, double *,
                                         void *) : 1,
                       default : 0),
              "Ipopt must use double numbers and int indices (Jacobian)");
static_assert(_Generic((Eval_H_CB)0,
                       morph_ip_bool (*)(int, double *, morph_ip_bool, double, int, double *, morph_ip_bool,
                                         int, int *, int *, double *, void *) : 1,
                       default : 0),
              "Ipopt must use double numbers and int indices (Hessian)");
static_assert(_Generic((Intermediate_CB)0,
                       morph_ip_bool (*)(int, int, double, double, double, double, double, double, double,
                                         double, int, void *) : 1,
                       default : 0),
              "Ipopt must use double numbers and int indices (iteration)");
static_assert(sizeof(enum ApplicationReturnStatus) == sizeof(int), "Ipopt's return code is an int");

#endif
