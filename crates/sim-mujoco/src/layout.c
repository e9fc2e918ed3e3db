// Prints the offsets in layout.rs: cc -I <folder with MuJoCo's headers> layout.c && ./a.out
#include <mujoco/mujoco.h>
#include <stddef.h>
#include <stdio.h>

#define PRINT(type, field) printf("%-10s %-24s %zu\n", #type, #field, offsetof(type, field));

int main(void) {
  PRINT(mjModel, nq)
  PRINT(mjModel, nv)
  PRINT(mjModel, nbody)
  PRINT(mjModel, nbuffer)
  PRINT(mjModel, opt.timestep)
  PRINT(mjModel, opt.integrator)
  PRINT(mjModel, buffer)
  PRINT(mjModel, body_ipos)
  PRINT(mjModel, body_iquat)
  PRINT(mjModel, body_mass)
  PRINT(mjModel, body_inertia)
  PRINT(mjData, nbuffer)
  PRINT(mjData, warning[mjWARN_INERTIA].number)
  PRINT(mjData, ncon)
  PRINT(mjData, buffer)
  PRINT(mjData, qpos)
  PRINT(mjData, qvel)
  PRINT(mjData, qacc_warmstart)
  PRINT(mjData, qfrc_applied)
  PRINT(mjData, qacc)
  PRINT(mjData, xpos)
  PRINT(mjData, xmat)
  PRINT(mjData, subtree_com)
  PRINT(mjData, qfrc_inverse)
  PRINT(mjData, cfrc_int)
  PRINT(mjData, contact)
  PRINT(mjContact, pos)
  PRINT(mjContact, frame)
  PRINT(mjContact, geom)
  printf("%-10s %-24s %zu\n", "mjContact", "(size)", sizeof(mjContact));
  return 0;
}
