/* The blanket beside Bullet's soft body: bench_bullet [NODES...].
 *
 * A cloth of n x n nodes over the same ball, of the same mass, stepped as often for the same time: Bullet's
 * has one layer of links (4 position iterations a step, the ball rigid, nodes against it, no exact limits and
 * no bending elements), ours two layers with posts, angle limits, skin contact and friction. Seconds a step
 * and a node and step of both. */
#include <cstdio>
#include <cstdlib>

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

extern "C" {
#include "model/blanket.h"
}

struct result {
    int steps;
    double seconds, step;
};

/* Our blanket over the ball, without exact distances; 0 steps where something is refused. */
static result run_blanket(int nodes, double time) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = nodes;
    def.stiffness = 20.0;
    const double r = 0.03 * (nodes - 1), radii[3] = {r, r, r}, w = 0.05 * (nodes - 1) + 0.1;
    const double lo[3] = {-w, -w, -0.05}, hi[3] = {w, w, 2.0 * r + 0.25};
    morph_structure *s = nullptr;
    morph_distance *exact = nullptr;
    morph_sdf *sdf = nullptr;
    double *start = nullptr;
    morph_mesh mesh = {};
    morph_trajectory t = {};
    morph_blanket_report report = {};
    result out = {};
    bool good = morph_structure_create(&def, &s) == MORPH_OK &&
                morph_mesh_ellipsoid(radii, 2e-3 * r, &mesh) == MORPH_OK;
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += r;
    good = good && morph_distance_create(&mesh, true, &exact) == MORPH_OK &&
           morph_sdf_create(exact, lo, hi, nodes > 32 ? 0.05 : 0.0125, nullptr, &sdf) == MORPH_OK &&
           (start = static_cast<double *>(morph_alloc(3 * static_cast<size_t>(s->joints), sizeof *start)));
    if (good) {
        for (int i = 0; i < 3 * s->joints; i++)
            start[i] = s->start[i] + (i % 3 == 2 ? 2.0 * r + 0.02 : 0.0);
        morph_blanket_def d = {};
        d.gravity = 9.81;
        d.drag = 0.2;
        d.friction = 0.4;
        d.time = time;
        d.frame = 0.02;
        d.base = NAN;
        if (morph_blanket_run(s, sdf, nullptr, &d, start, nullptr, &t, &report) == MORPH_OK)
            out = {report.steps, report.seconds, t.time[t.frames - 1] / report.steps};
    }
    morph_trajectory_free(&t);
    morph_mesh_free(&mesh);
    morph_sdf_destroy(sdf);
    morph_distance_destroy(exact);
    morph_structure_destroy(s);
    std::free(start);
    return out;
}

/* Bullet's world is left to its destructors in reverse order of creation. */
static result run_bullet(int nodes, double mass, const result &like) {
    const btScalar r = btScalar(0.03 * (nodes - 1)), half = btScalar(0.05 * (nodes - 1)), top = 2 * r;
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(btVector3(0, 0, btScalar(-9.81)));
    btSoftBodyWorldInfo &info = world.getWorldInfo();
    info.m_gravity.setValue(0, 0, btScalar(-9.81));
    info.m_sparsesdf.Initialize();
    btSphereShape shape(r);
    btTransform at(btQuaternion::getIdentity(), btVector3(0, 0, r));
    btRigidBody ball(0, nullptr, &shape);
    ball.setWorldTransform(at);
    world.addRigidBody(&ball);
    const btScalar z = top + btScalar(0.02);
    btSoftBody *cloth = btSoftBodyHelpers::CreatePatch(info, btVector3(-half, -half, z),
                                                       btVector3(half, -half, z), btVector3(-half, half, z),
                                                       btVector3(half, half, z), nodes, nodes, 0, true);
    cloth->m_cfg.kDF = btScalar(0.4);
    cloth->m_cfg.piterations = 4;
    cloth->getCollisionShape()->setMargin(btScalar(0.004));
    cloth->setTotalMass(btScalar(mass));
    world.addSoftBody(cloth);
    const double begin = morph_seconds();
    for (int k = 0; k < like.steps; k++)
        world.stepSimulation(btScalar(like.step), 0);
    const double seconds = morph_seconds() - begin;
    btScalar lowest = 0, deepest = 0;
    for (int k = 0; k < cloth->m_nodes.size(); k++) {
        const btVector3 &q = cloth->m_nodes[k].m_x;
        lowest = btMin(lowest, q.z());
        deepest = btMax(deepest, r - (q - btVector3(0, 0, r)).length());
    }
    std::printf(
        "  Bullet's %d nodes, %d links; at the end lowest node at %.3f m, deepest %.4f m inside the ball\n",
        cloth->m_nodes.size(), cloth->m_links.size(), double(lowest), double(deepest));
    world.removeSoftBody(cloth);
    delete cloth;
    world.removeRigidBody(&ball);
    return {like.steps, seconds, like.step};
}

int main(int count, char **argument) {
    static const int sizes[] = {4, 16, 64};
    morph_blas_threads(1);
    for (int k = 0; k < (count > 1 ? count - 1 : 3); k++) {
        const int nodes = count > 1 ? std::atoi(argument[k + 1]) : sizes[k];
        if (nodes < 2 || nodes > 256) continue;
        const result own = run_blanket(nodes, nodes > 32 ? 0.3 : 1.0);
        if (own.steps == 0) {
            std::printf("%d x %d cannot be run\n", nodes, nodes);
            continue;
        }
        const double n = double(nodes) * nodes;
        std::printf("%d x %d, %d steps of %.2e s\n", nodes, nodes, own.steps, own.step);
        const result peer = run_bullet(nodes, 2.0 * n * morph_structure_defaults(0.1).mass, own);
        std::printf("  blanket %8.1f us a step, %6.1f ns a joint and step\n", 1e6 * own.seconds / own.steps,
                    1e9 * own.seconds / own.steps / (2.0 * n));
        std::printf("  Bullet  %8.1f us a step, %6.1f ns a node and step; ratio a step %.2f, a node %.2f\n",
                    1e6 * peer.seconds / peer.steps, 1e9 * peer.seconds / peer.steps / n,
                    own.seconds / peer.seconds, 0.5 * own.seconds / peer.seconds);
    }
    return 0;
}
