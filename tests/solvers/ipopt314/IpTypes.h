/* Number and index types of Ipopt 3.14's C interface, for a test that only compiles. */
#ifndef TEST_IPOPT314_TYPES_H
#define TEST_IPOPT314_TYPES_H

typedef double ipnumber;
typedef int ipindex;

#endif
