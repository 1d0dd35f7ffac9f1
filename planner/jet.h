/* Truncated Taylor arithmetic: coefficient k of a jet is the k-th derivative over k!. Internal. */
#ifndef MORPH_JET_H
#define MORPH_JET_H

/* Coefficients of a jet at most: derivatives 0..5. */
enum { MORPH_JET = 6 };

extern const double morph_factorial[MORPH_JET];

/* out = u.v of two vectors of jets. out must not alias them. */
void morph_jet_dot(const double (*u)[MORPH_JET], const double (*v)[MORPH_JET], int order, double *out);

/* r = sqrt(a), a[0] > 0. r must not alias a. */
void morph_jet_sqrt(const double *a, int order, double *r);

/* q = a / b, b[0] != 0. q may alias a. */
void morph_jet_divide(const double *a, const double *b, int order, double *q);

#endif
