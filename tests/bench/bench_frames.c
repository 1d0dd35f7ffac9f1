/* The blanket's recorded frames by exact distances: bench_frames [NODES...] (8 and 12), from the project's
 * root.
 *
 * For each scene: frames, seconds, whether it comes to rest and when, and over every recorded frame the least
 * clearance of joints, links, skin (FCL) and of joints over the base plane, joints inside the target (solid
 * angles), and the worst length beyond its limit, all in spacings. Allowed: clearance -1e-3, length 1e-9.
 */
#include "tests/model/frames.h"

static void show(const frames_scene *f, int nodes) {
    morph_scene *scene = frames_read(f, nodes, ".");
    morph_workspace work = {0};
    if (!scene || morph_workspace_create(scene, NULL, &work) != MORPH_OK) {
        printf("%-15s %2d x %-2d cannot be read%s\n", f->name, nodes, nodes,
               f->shared ? " (needs ../shared/models)" : "");
        morph_scene_destroy(scene);
        return;
    }
    const morph_blanket_def def = morph_scene_blanket(scene, work.structure);
    morph_trajectory t;
    morph_blanket_report r;
    frames_measure m;
    const morph_status status =
        morph_blanket_run(work.structure, work.sdf, work.exact, &def, work.start, NULL, &t, &r);
    if (status == MORPH_OK && frames_examine(work.structure, &scene->target, scene->base, &t, &m)) {
        printf("%-15s %2d x %-2d %4d frames %6.2f s  %s %5.2f s (%.1e m/s)  ", f->name, nodes, nodes,
               m.frames, r.seconds, r.at_rest ? "at rest after" : "MOVES after  ", t.time[t.frames - 1],
               r.rest_speed);
        printf("joints %+.2e links %+.2e skin %+.2e base %+.2e inside %d length %+.1e halvings %d%s%s\n",
               m.joint, m.link, m.skin, m.base, m.joints_inside, m.length, r.step_halvings,
               r.held_up ? " held up" : "",
               fmin(fmin(m.joint, m.link), m.skin) >= -1e-3 && m.length <= 1e-9 ? "" : "  FAILS");
    } else
        printf("%-15s %2d x %-2d %s\n", f->name, nodes, nodes, morph_status_text(status));
    morph_trajectory_free(&t);
    morph_workspace_free(&work);
    morph_scene_destroy(scene);
}

int main(int argc, char **argv) {
    static const int usual[] = {8, 12};
    setvbuf(stdout, NULL, _IOLBF, 0);
    morph_blas_threads(1);
    for (int k = 0; k < (argc > 1 ? argc - 1 : 2); k++) {
        const int nodes = argc > 1 ? atoi(argv[k + 1]) : usual[k];
        for (int i = 0; nodes >= 2 && i < FRAMES_SCENES; i++)
            show(&frames_scenes[i], nodes);
    }
    return 0;
}
