use raystrips_pack::*; use std::io::*;
fn main(){ for path in std::env::args().skip(1){ let mut file=std::fs::File::open(&path).unwrap(); let pack=Pack::open(&mut file).unwrap();
 let (mut n,mut wide,mut fl)=(0,0,0); let mut sums=[0u64;16]; let mut ord=[0;4];
 for e in &pack.directory { let mut buf=vec![0u64;(e.bytes as usize+7)/8+8]; let off=(64-(buf.as_ptr() as usize&63))&63; let b:&mut [u8]=bytemuck::cast_slice_mut(&mut buf); let b=&mut b[off..off+e.bytes as usize]; file.seek(SeekFrom::Start(e.offset)).unwrap(); file.read_exact(b).unwrap(); let page=PageView::new(b).unwrap();
  if !page.header().holds_strands() {continue;}
  for c in 0..page.cluster_count(){ let cl=page.cluster(c); let s=cl.strand_code(); let v=cl.vertex_code(); n+=1; let [x,y,z]=v.bits; let all=[[x,y,z,s.radius_bits],s.step,s.bend,s.rest];
   if all.iter().any(|w|w[0]+w[1]>57||w[2]+w[3]>57){wide+=1;} if (0..3).any(|a|v.is_float(a)){fl+=1;} for (i,w) in all.iter().flatten().enumerate(){sums[i]+=*w as u64;} ord[s.order as usize]+=1; } }
 println!("{path}: clusters {n} wide {wide} float {fl} orders {ord:?} mean {:?}",sums.map(|s|s as f64/n as f64)); } }
