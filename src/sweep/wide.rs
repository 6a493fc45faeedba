//! The widest vector instructions this machine has, chosen at run time. No operation is fused and
//! no sum reordered, so the results have the same bits on every path.

/// A piece of work whose `run` is inlined into a function compiled for wide vectors.
pub trait Task {
    /// Does the work; implementations must be `#[inline(always)]`.
    fn run(self);
}

/// Runs a task with AVX2 where there is AVX2.
#[inline]
pub fn run_wide<T: Task>(task: T) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,bmi2")]
        fn with_avx2<T: Task>(task: T) {
            task.run();
        }
        if std::is_x86_feature_detected!("avx2")
            && std::is_x86_feature_detected!("fma")
            && std::is_x86_feature_detected!("bmi2")
        {
            // SAFETY: the features were just detected.
            unsafe { with_avx2(task) };
            return;
        }
    }
    task.run();
}
