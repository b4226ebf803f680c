//! Parallel processing of items with one thread per processor.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Maximum number of threads; more would wait for memory, not for processors.
const MAX_THREADS: usize = 16;

/// Returns the result of `work` for each item, in the order of the items. Each thread has its own
/// worker (plans and buffers) from `worker`.
///
/// # Errors
/// The first error in the order of the items.
pub(super) fn in_parallel<T: Sync, W, R: Send, E: Send>(
    items: &[T],
    worker: impl Fn() -> Result<W, E> + Sync,
    work: impl Fn(&mut W, &T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let next = AtomicUsize::new(0);
    let run = || {
        let mut own = None;
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return done;
            };
            let made = own.take().map_or_else(&worker, Ok);
            done.push((
                index,
                made.and_then(|mut it| {
                    let result = work(&mut it, item);
                    own = Some(it);
                    result
                }),
            ));
        }
    };
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    let others = processors
        .min(MAX_THREADS)
        .min(items.len())
        .saturating_sub(1);
    let mut done = thread::scope(|scope| {
        // If no thread can be created, the existing ones process its items.
        let helpers: Vec<_> = (0..others)
            .filter_map(|_| thread::Builder::new().spawn_scoped(scope, run).ok())
            .collect();
        let mut done = run();
        for helper in helpers {
            match helper.join() {
                Ok(part) => done.extend(part),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    done.sort_unstable_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_ordered_and_the_first_error_is_returned() {
        let items: Vec<u32> = (0..1000).collect();
        let squares = in_parallel(
            &items,
            || Ok::<_, ()>(1),
            |one, item| Ok(item * item * *one),
        );
        assert_eq!(squares, Ok(items.iter().map(|it| it * it).collect()));
        let fails = |(): &mut (), item: &u32| if *item % 7 == 5 { Err(*item) } else { Ok(()) };
        assert_eq!(in_parallel(&items, || Ok(()), fails), Err(5));
        assert_eq!(in_parallel(&[0; 0], || Err(3), fails), Ok(Vec::new()));
    }
}
