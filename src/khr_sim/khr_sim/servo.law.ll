; khr_sim.servo.law ee34539ba4ec77edcc8798dbb6b0812134ece3995357106de986c0bba00e7e2f
; ModuleID = '<string>'
source_filename = "<string>"

; Function Attrs: nofree norecurse nosync nounwind memory(argmem: readwrite)
define internal fastcc void @_ZN7khr_sim8compiled13_intermediate12_3clocals_3e5entryB2v1B56c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAg6cJqBrMeIZJFEGM0QQAE10float64_2a10float64_2a(ptr noalias nonnull writeonly captures(none) %retptr, ptr captures(none) %arg.first, ptr readonly captures(none) %arg.second) unnamed_addr #0 {
B0.endif.endif:
  %.64.i = load double, ptr %arg.second, align 8, !noalias !0
  %.92.i = getelementptr i8, ptr %arg.second, i64 8
  %.93.i = load double, ptr %.92.i, align 8, !noalias !0
  %.121.i = getelementptr i8, ptr %arg.second, i64 16
  %.122.i = load double, ptr %.121.i, align 8, !noalias !0
  %.159.i = getelementptr i8, ptr %arg.second, i64 24
  %.160.i = load double, ptr %.159.i, align 8, !noalias !0
  %.188.i = getelementptr i8, ptr %arg.second, i64 32
  %.189.i = load double, ptr %.188.i, align 8, !noalias !0
  %.284.i = getelementptr i8, ptr %arg.second, i64 56
  %.285.i = load double, ptr %.284.i, align 8, !noalias !0
  %.255.i = getelementptr i8, ptr %arg.second, i64 48
  %.256.i = load double, ptr %.255.i, align 8, !noalias !0
  %.217.i = getelementptr i8, ptr %arg.second, i64 40
  %.218.i = load double, ptr %.217.i, align 8, !noalias !0
  %0 = getelementptr i8, ptr %arg.first, i64 544
  %1 = getelementptr i8, ptr %arg.first, i64 136
  %2 = getelementptr i8, ptr %arg.first, i64 1632
  %3 = getelementptr i8, ptr %arg.first, i64 272
  %.728.i = fmul double %.64.i, %.285.i
  %4 = getelementptr i8, ptr %arg.first, i64 1496
  %5 = getelementptr i8, ptr %arg.first, i64 408
  %6 = getelementptr i8, ptr %arg.first, i64 680
  %7 = getelementptr i8, ptr %arg.first, i64 816
  %.1180.i = fneg double %.189.i
  %8 = getelementptr i8, ptr %arg.first, i64 1224
  %9 = getelementptr i8, ptr %arg.first, i64 1360
  %10 = getelementptr i8, ptr %arg.first, i64 1088
  %.1541.i = fneg double %.160.i
  %11 = getelementptr i8, ptr %arg.first, i64 952
  %12 = fcmp une double %.256.i, 0.000000e+00
  %13 = fcmp une double %.218.i, 0.000000e+00
  %14 = fcmp une double %.189.i, 0.000000e+00
  br label %B188.i

B188.i:                                           ; preds = %B994.i, %B0.endif.endif
  %.398551558.i = phi i64 [ 0, %B0.endif.endif ], [ %.405.i, %B994.i ]
  %.405.i = add nuw nsw i64 %.398551558.i, 1
  %15 = shl i64 %.398551558.i, 3
  %scevgep.i = getelementptr i8, ptr %0, i64 %15
  %.487.i = load double, ptr %scevgep.i, align 8, !noalias !0
  %scevgep16.i = getelementptr i8, ptr %arg.first, i64 %15
  %.542.i = load double, ptr %scevgep16.i, align 8, !noalias !0
  %scevgep17.i = getelementptr i8, ptr %1, i64 %15
  %.597.i = load double, ptr %scevgep17.i, align 8, !noalias !0
  %scevgep11.i = getelementptr i8, ptr %2, i64 %15
  %.661.i = load double, ptr %scevgep11.i, align 8, !noalias !0
  br i1 %12, label %B318.endif.endif.i, label %B458.i

B458.i:                                           ; preds = %B318.endif.endif.i, %B188.i
  %offset.3.1.i = phi double [ %.13.i11.i, %B318.endif.endif.i ], [ 0.000000e+00, %B188.i ]
  br i1 %13, label %B462.i, label %B548.i

B462.i:                                           ; preds = %B458.i
  %scevgep9.i = getelementptr i8, ptr %4, i64 %15
  %.912.i = load double, ptr %scevgep9.i, align 8, !noalias !0
  %scevgep7.i = getelementptr i8, ptr %5, i64 %15
  %.967.i = load double, ptr %scevgep7.i, align 8, !noalias !0
  %.969.i = fsub double %.487.i, %.967.i
  %.974.i = fdiv double %.969.i, %.64.i
  %.976.i = fsub double %.974.i, %.597.i
  %.977.i = fmul double %.912.i, %.976.i
  %.979.i = fadd double %offset.3.1.i, %.977.i
  br label %B548.i

B548.i:                                           ; preds = %B462.i, %B458.i
  %offset.4.1.i = phi double [ %.979.i, %B462.i ], [ %offset.3.1.i, %B458.i ]
  %scevgep6.i = getelementptr i8, ptr %5, i64 %15
  store double %.487.i, ptr %scevgep6.i, align 8, !noalias !0
  %scevgep8.i = getelementptr i8, ptr %6, i64 %15
  %.1097.i = load double, ptr %scevgep8.i, align 8, !noalias !0
  %.1099.i = fsub double %.542.i, %.1097.i
  %scevgep5.i = getelementptr i8, ptr %7, i64 %15
  %.1154.i = load double, ptr %scevgep5.i, align 8, !noalias !0
  %.1156.i = fsub double %.597.i, %.1154.i
  br i1 %14, label %B648.endif.endif.i, label %B732.endif.endif.i

B728.i:                                           ; preds = %B648.endif.endif.i
  br label %B732.endif.endif.i

B952.i:                                           ; preds = %B732.endif.endif.i
  %.1533.i = fsub double %.1523.i, %.160.i
  br label %B994.i

B964.i:                                           ; preds = %B732.endif.endif.i
  %.1543.i = fcmp olt double %.1523.i, %.1541.i
  br i1 %.1543.i, label %B978.i, label %B994.i

B978.i:                                           ; preds = %B964.i
  %.1547.i = fadd double %.160.i, %.1523.i
  br label %B994.i

B994.i:                                           ; preds = %B978.i, %B964.i, %B952.i
  %rate.5.1.i = phi double [ %.1533.i, %B952.i ], [ %.1547.i, %B978.i ], [ 0.000000e+00, %B964.i ]
  %scevgep1.i = getelementptr i8, ptr %11, i64 %15
  store double %.1384.i, ptr %scevgep1.i, align 8, !noalias !0
  %.1618.i = fmul double %.64.i, %rate.5.1.i
  %.1620.i = fadd double %.542.i, %.1618.i
  store double %.1620.i, ptr %scevgep16.i, align 8, !noalias !0
  store double %rate.5.1.i, ptr %scevgep17.i, align 8, !noalias !0
  %exitcond.not.i = icmp eq i64 %.405.i, 17
  br i1 %exitcond.not.i, label %_ZN7khr_sim5servo3lawB2v4B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE5ArrayIdLi2E1C7mutable7alignedE5ArrayIdLi1E1C7mutable7alignedE.exit, label %B188.i

B318.endif.endif.i:                               ; preds = %B188.i
  %scevgep10.i = getelementptr i8, ptr %3, i64 %15
  %.725.i = load double, ptr %scevgep10.i, align 8, !noalias !0
  %.731.i = fsub double %.487.i, %.542.i
  %.732.i = fmul double %.728.i, %.731.i
  %.733.i = fadd double %.732.i, %.725.i
  %.735.i = fneg double %.661.i
  %.12.i.i = fcmp olt double %.733.i, %.735.i
  %.13.i.i = select i1 %.12.i.i, double %.735.i, double %.733.i
  %.12.i10.i = fcmp olt double %.661.i, %.13.i.i
  %.13.i11.i = select i1 %.12.i10.i, double %.661.i, double %.13.i.i
  store double %.13.i11.i, ptr %scevgep10.i, align 8, !noalias !0
  br label %B458.i

B648.endif.endif.i:                               ; preds = %B548.i
  %.12.i6.i = fcmp olt double %.1099.i, %.1180.i
  %.13.i7.i = select i1 %.12.i6.i, double %.1180.i, double %.1099.i
  %.12.i12.i = fcmp olt double %.189.i, %.13.i7.i
  %.13.i13.i = select i1 %.12.i12.i, double %.189.i, double %.13.i7.i
  %.1240.i = fsub double %.1099.i, %.13.i13.i
  %.1250.i = fcmp oeq double %.1240.i, 0.000000e+00
  br i1 %.1250.i, label %B728.i, label %B732.endif.endif.i

B732.endif.endif.i:                               ; preds = %B648.endif.endif.i, %B728.i, %B548.i
  %slide.2.1.i = phi double [ 0.000000e+00, %B728.i ], [ %.1156.i, %B648.endif.endif.i ], [ %.1156.i, %B548.i ]
  %twist.2.1.i = phi double [ %.1240.i, %B728.i ], [ %.1240.i, %B648.endif.endif.i ], [ %.1099.i, %B548.i ]
  %scevgep3.i = getelementptr i8, ptr %8, i64 %15
  %.1320.i = load double, ptr %scevgep3.i, align 8, !noalias !0
  %.1322.i = fmul double %twist.2.1.i, %.1320.i
  %scevgep4.i = getelementptr i8, ptr %9, i64 %15
  %.1379.i = load double, ptr %scevgep4.i, align 8, !noalias !0
  %.1381.i = fmul double %slide.2.1.i, %.1379.i
  %.1384.i = fadd double %.1322.i, %.1381.i
  %scevgep2.i = getelementptr i8, ptr %10, i64 %15
  %.1442.i = load double, ptr %scevgep2.i, align 8, !noalias !0
  %.1445.i = fsub double %.487.i, %.542.i
  %.1448.i = fmul double %.1445.i, %.1442.i
  %.1450.i = fadd double %offset.4.1.i, %.1448.i
  %.1454.i = fneg double %.661.i
  %.12.i8.i = fcmp olt double %.1450.i, %.1454.i
  %.13.i9.i = select i1 %.12.i8.i, double %.1454.i, double %.1450.i
  %.12.i14.i = fcmp olt double %.661.i, %.13.i9.i
  %.13.i15.i = select i1 %.12.i14.i, double %.661.i, double %.13.i9.i
  %.1515.i = fsub double %.13.i15.i, %.1384.i
  %.1517.i = fmul double %.93.i, %.1515.i
  %.1519.i = fadd double %.597.i, %.1517.i
  %.1523.i = fmul double %.122.i, %.1519.i
  %.1529.i = fcmp ogt double %.1523.i, %.160.i
  br i1 %.1529.i, label %B952.i, label %B964.i

_ZN7khr_sim5servo3lawB2v4B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE5ArrayIdLi2E1C7mutable7alignedE5ArrayIdLi1E1C7mutable7alignedE.exit: ; preds = %B994.i
  store ptr null, ptr %retptr, align 8
  ret void
}

; Function Attrs: nofree norecurse nosync nounwind memory(argmem: readwrite)
define ptr @entry(ptr captures(none) %.1, ptr readonly captures(none) %.2) local_unnamed_addr #0 {
entry:
  %.4 = alloca ptr, align 8
  store ptr null, ptr %.4, align 8
  call fastcc void @_ZN7khr_sim8compiled13_intermediate12_3clocals_3e5entryB2v1B56c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAg6cJqBrMeIZJFEGM0QQAE10float64_2a10float64_2a(ptr nonnull %.4, ptr %.1, ptr %.2) #1
  %.18 = load ptr, ptr %.4, align 8
  ret ptr %.18
}

attributes #0 = { nofree norecurse nosync nounwind memory(argmem: readwrite) }
attributes #1 = { noinline }

!0 = !{!1}
!1 = distinct !{!1, !2, !"_ZN7khr_sim5servo3lawB2v4B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE5ArrayIdLi2E1C7mutable7alignedE5ArrayIdLi1E1C7mutable7alignedE: %retptr"}
!2 = distinct !{!2, !"_ZN7khr_sim5servo3lawB2v4B44c8tJTIeFIjxB2IKSgI4CrvQCk0Z4yRYcWsBAK4JIagIAE5ArrayIdLi2E1C7mutable7alignedE5ArrayIdLi1E1C7mutable7alignedE"}
