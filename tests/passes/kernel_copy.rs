//! The copy kernel, the standard for data movers, copies every requested word and no more.

use crate::common::{assert_silent, context, random_words};
use lightpaths::gpu::Buffer;
use lightpaths::passes::kernel_copy::KernelCopy;

#[test]
fn a_list_is_copied_and_what_lies_behind_it_is_not() {
    let context = context();
    let words = random_words(5, 1000);
    let from = Buffer::from_slice(&context, "from", &words).unwrap();
    for kernel in [KernelCopy::of_texels(&context).unwrap(), KernelCopy::of_words(&context).unwrap()] {
        for count in [4, 256, 932] {
            let to = Buffer::from_slice(&context, "to", &[7_u32; 1000]).unwrap();
            context.run(|rec| kernel.record(rec, &from, &to, count as u32)).unwrap();
            let copied = to.read::<u32>().unwrap();
            assert_eq!(copied[..count], words[..count]);
            assert!(copied[count..].iter().all(|&word| word == 7));
        }
    }
    assert_silent(&context);
}
