/* Declarations of Ipopt 3.14's C interface, as far as this project uses it, for a test that only compiles:
 * the solver's source must build with bool callbacks as it does with the int callbacks of 3.11. The old type
 * names are deprecated there, so using one is a warning. */
#ifndef TEST_IPOPT314_INTERFACE_H
#define TEST_IPOPT314_INTERFACE_H

#include "IpTypes.h"
#include <stdbool.h>

typedef ipnumber Number __attribute__((deprecated));
typedef ipindex Index __attribute__((deprecated));
typedef int Int __attribute__((deprecated));
typedef bool Bool;
typedef void *UserDataPtr;

enum ApplicationReturnStatus { Solve_Succeeded = 0, Maximum_WallTime_Exceeded = -5, Internal_Error = -199 };

struct IpoptProblemInfo;
typedef struct IpoptProblemInfo *IpoptProblem;

typedef bool (*Eval_F_CB)(ipindex, ipnumber *, bool, ipnumber *, UserDataPtr);
typedef bool (*Eval_Grad_F_CB)(ipindex, ipnumber *, bool, ipnumber *, UserDataPtr);
typedef bool (*Eval_G_CB)(ipindex, ipnumber *, bool, ipindex, ipnumber *, UserDataPtr);
typedef bool (*Eval_Jac_G_CB)(ipindex, ipnumber *, bool, ipindex, ipindex, ipindex *, ipindex *, ipnumber *,
                              UserDataPtr);
typedef bool (*Eval_H_CB)(ipindex, ipnumber *, bool, ipnumber, ipindex, ipnumber *, bool, ipindex, ipindex *,
                          ipindex *, ipnumber *, UserDataPtr);
typedef bool (*Intermediate_CB)(ipindex, ipindex, ipnumber, ipnumber, ipnumber, ipnumber, ipnumber, ipnumber,
                                ipnumber, ipnumber, ipindex, UserDataPtr);

IpoptProblem CreateIpoptProblem(ipindex, ipnumber *, ipnumber *, ipindex, ipnumber *, ipnumber *, ipindex,
                                ipindex, ipindex, Eval_F_CB, Eval_G_CB, Eval_Grad_F_CB, Eval_Jac_G_CB,
                                Eval_H_CB);
void FreeIpoptProblem(IpoptProblem);
bool AddIpoptStrOption(IpoptProblem, char *, char *);
bool AddIpoptNumOption(IpoptProblem, char *, ipnumber);
bool AddIpoptIntOption(IpoptProblem, char *, ipindex);
bool SetIntermediateCallback(IpoptProblem, Intermediate_CB);
enum ApplicationReturnStatus IpoptSolve(IpoptProblem, ipnumber *, ipnumber *, ipnumber *, ipnumber *,
                                        ipnumber *, ipnumber *, UserDataPtr);

#endif
