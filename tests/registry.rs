//! The one table of combinations. Here and not in the library, whose tests then need not compile the
//! loops of all of them.

use sdpd::registry::{build, combinations};

#[test]
fn every_listed_combination_builds_and_others_say_why_not() {
    let all = combinations();
    // isothermal, in two precisions; then friction (2 forms) with noise or without, and without friction
    let isothermal = 2 * (2 + 2 + 1) + 2;
    // With friction ten exchanges, and two more that are accepted or rejected, with Gaussian noise
    // and by the splitting alone; without friction three, none at all, and one that is accepted.
    let splitting = 2 * (2 * 10 + 2) + 2 * 3 + 1 + 1;
    // With energies velocity Verlet takes uniform noise too.
    let verlet = 2 * 3 * 10 + 3 * 3 + 1;
    assert_eq!(all.len(), 2 * 4 * (2 * isothermal + splitting + verlet));
    for combination in &all {
        assert!(build(combination, 1).is_ok());
    }
    let mut wish = all[0].clone();
    wish.kernel = "gauss".into();
    let text = build(&wish, 0).err().unwrap().to_string();
    assert!(text.contains("`kernel` must be one of") && text.contains("lucy"));
    wish.kernel = "lucy".into();
    wish.noise = "gaussian".into();
    let text = build(&wish, 0).err().unwrap().to_string();
    assert!(text.contains("nothing to balance"));
    wish.exchanges = "conduction".into();
    for (integrator, noise) in [
        ("velocity_verlet", "gaussian"),
        ("velocity_verlet", "uniform"),
        ("pair_splitting", "gaussian"),
    ] {
        (wish.integrator, wish.noise) = (integrator.into(), noise.into());
        assert!(build(&wish, 0).is_ok());
    }
    wish.noise = "uniform".into();
    let text = build(&wish, 0).err().unwrap().to_string();
    assert!(text.contains("`noise` must be"));
    wish.noise = "gaussian".into();
    wish.exchanges = "full".into();
    let text = build(&wish, 0).err().unwrap().to_string();
    assert!(text.contains("`exchanges` must be one of"));
}
